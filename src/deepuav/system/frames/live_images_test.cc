#include "deepuav/system/frames/live_images.h"

#include <gtest/gtest.h>

#include "support/synthetic_flight.h"

namespace deepuav {
namespace {

TEST(LiveImages, GiveAllAtTheirPaceToWhoIsQuick) {
  NumberedImages images(10, 0.03);
  LiveImages live(&images);
  const Stopwatch watch;
  for (int i = 0; i < 10; ++i) {
    const auto image = live.Next();
    ASSERT_TRUE(image);
    EXPECT_GE(watch.Seconds(), 0.03 * static_cast<double>(image->id.value) - 1e-3) << "not early";
  }
  EXPECT_FALSE(live.Next());
}

TEST(LiveImages, EndWhenStoppedWhileTheyWait) {
  NumberedImages images(3, 3600);
  const Stopwatch watch;
  LiveImages live(&images, [&watch] { return watch.Seconds() > 0.2; });
  EXPECT_TRUE(live.Next());
  EXPECT_FALSE(live.Next()) << "an hour later";
  EXPECT_LT(watch.Seconds(), 60);
}

TEST(LiveImages, LeaveOutWhatCameWhileOneWasBusy) {
  constexpr int kCount = 40;
  constexpr double kInterval = 0.01;
  NumberedImages images(kCount, kInterval);
  LiveImages live(&images);
  int given = 0;
  int64_t before = -1;
  while (const auto image = live.Next()) {
    ++given;
    EXPECT_LT(before, image->id.value);
    before = image->id.value;
    const Stopwatch busy;
    while (busy.Seconds() < 0.055) {
    }
  }
  EXPECT_EQ(before, kCount - 1) << "the last is not overtaken";
  EXPECT_LE(given, 10);
  EXPECT_GE(given, 2);
  EXPECT_EQ(given + live.skipped(), kCount);
  EXPECT_EQ(images.read(), given) << "what is left out is not decoded";
}

TEST(LiveImages, EndWhenStoppedWhileTheyCatchUp) {
  NumberedImages images(1000, 1e-6);
  bool stop = false;
  LiveImages live(&images, [&stop] { return stop; });
  ASSERT_TRUE(live.Next());
  const Stopwatch busy;
  while (busy.Seconds() < 0.01) {
  }
  stop = true;
  EXPECT_FALSE(live.Next());
  EXPECT_EQ(live.skipped(), 0);
}

}  // namespace
}  // namespace deepuav
