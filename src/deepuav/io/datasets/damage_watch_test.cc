#include "deepuav/io/datasets/damage_watch.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

constexpr int64_t kFrameNs = 40'000'000;

TEST(DamageWatch, LastsUntilAPictureStandsAlone) {
  DamageWatch watch{DamageOptions{}};
  EXPECT_FALSE(watch.Judge(false, true, 0));
  EXPECT_FALSE(watch.Judge(false, false, kFrameNs));
  EXPECT_TRUE(watch.Judge(true, false, 2 * kFrameNs));
  EXPECT_TRUE(watch.Judge(false, false, 3 * kFrameNs));
  EXPECT_FALSE(watch.Judge(false, true, 4 * kFrameNs));
  EXPECT_FALSE(watch.Judge(false, false, 5 * kFrameNs));
}

TEST(DamageWatch, APictureThatStandsAloneMayBeDamagedItself) {
  DamageWatch watch{DamageOptions{}};
  EXPECT_TRUE(watch.Judge(true, true, 0));
  EXPECT_TRUE(watch.Judge(false, false, kFrameNs));
  EXPECT_FALSE(watch.Judge(false, true, 2 * kFrameNs));
}

TEST(DamageWatch, WhatFollowsALostPacketBuildsOnIt) {
  DamageWatch watch{DamageOptions{}};
  watch.Judge(false, true, 0);
  watch.Lost();
  EXPECT_TRUE(watch.Judge(false, false, 2 * kFrameNs));
  EXPECT_FALSE(watch.Judge(false, true, 3 * kFrameNs));
}

TEST(DamageWatch, EndsInStreamsWhereNothingStandsAlone) {
  for (const bool has_times : {true, false}) {
    DamageWatch watch{DamageOptions{}};
    watch.Judge(true, false, has_times ? std::optional<int64_t>(0) : std::nullopt);
    int pictures = 1;
    for (; pictures < 1000; ++pictures) {
      const auto shown_ns = has_times ? std::optional<int64_t>(pictures * kFrameNs) : std::nullopt;
      if (!watch.Judge(false, false, shown_ns)) break;
    }
    EXPECT_GT(pictures, 100) << has_times;
    EXPECT_LT(pictures, 200) << has_times;
  }
}

TEST(DamageWatch, EndsAsTheOptionsSay) {
  DamageOptions options;
  options.longest_s = 0.1;
  options.most_pictures = 2;
  for (const bool has_times : {true, false}) {
    DamageWatch watch(options);
    int pictures = 0;
    const auto shown_ns = [&] {
      return has_times ? std::optional<int64_t>(pictures * kFrameNs) : std::nullopt;
    };
    watch.Judge(true, false, shown_ns());
    do ++pictures;
    while (watch.Judge(false, false, shown_ns()));
    EXPECT_EQ(pictures, 3) << has_times;
  }
}

}  // namespace
}  // namespace deepuav
