#include "deepuav/image/image_store.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/core.hpp>
#include <string>

namespace deepuav {
namespace {

constexpr int kLevels = 3;

std::shared_ptr<const ImagePyramid> Noise(int width, int height, int seed) {
  GreyImage image(height, width);
  cv::RNG(static_cast<uint64_t>(seed)).fill(image, cv::RNG::UNIFORM, 0, 256);
  return std::make_shared<const ImagePyramid>(image, kLevels);
}

void ExpectEqual(const ImagePyramid& found, const ImagePyramid& expected) {
  ASSERT_EQ(found.levels(), expected.levels());
  for (int level = 0; level < expected.levels(); ++level) {
    ASSERT_EQ(found.level(level).size(), expected.level(level).size());
    EXPECT_EQ(cv::norm(found.level(level), expected.level(level), cv::NORM_INF), 0);
  }
}

TEST(ImageStoreTest, GivesBackEveryPixelInAnyOrder) {
  ImageStore store(2);
  for (int i = 0; i < 7; ++i) ASSERT_EQ(store.Add(Noise(31 + i, 40 - i, i + 1)), i);
  for (const int i : {6, 0, 3, 3, 0, 5, 1, 6, 2, 4, 0})
    ExpectEqual(*store.At(i), *Noise(31 + i, 40 - i, i + 1));
}

TEST(ImageStoreTest, KeepsPixelsOfAnImageThatIsAPartOfAnother) {
  const auto whole = Noise(40, 30, 1);
  const GreyImage part = whole->image()(cv::Rect(3, 4, 20, 10));
  ImageStore store(1);
  store.Add(std::make_shared<const ImagePyramid>(part, kLevels));
  store.Add(whole);
  ExpectEqual(*store.At(0), ImagePyramid(part, kLevels));
}

TEST(ImageStoreTest, TheLastUsedStayInMemoryAndNoOthers) {
  ImageStore store(2);
  std::vector<std::weak_ptr<const ImagePyramid>> images;
  for (int i = 0; i < 3; ++i) {
    auto image = Noise(20, 20, i + 1);
    images.push_back(image);
    store.Add(std::move(image));
  }
  EXPECT_TRUE(images[0].expired());
  EXPECT_EQ(store.At(1), images[1].lock());
  store.Add(Noise(20, 20, 9));
  EXPECT_TRUE(images[2].expired());
  EXPECT_FALSE(images[1].expired());
}

TEST(ImageStoreTest, AnImageInUseOutlivesItsTurn) {
  ImageStore store(1);
  store.Add(Noise(20, 20, 1));
  const auto used = store.At(0);
  store.Add(Noise(20, 20, 2));
  ExpectEqual(*used, *Noise(20, 20, 1));
}

TEST(ImageStoreTest, WithoutRoomForAFileAllStayInMemory) {
  const char* before = std::getenv("TMPDIR");
  const std::string kept = before ? before : "";
  setenv("TMPDIR", "/nonexistent", 1);
  ImageStore store(1);
  for (int i = 0; i < 3; ++i) store.Add(Noise(20, 20, i + 1));
  before ? setenv("TMPDIR", kept.c_str(), 1) : unsetenv("TMPDIR");
  for (int i = 0; i < 3; ++i) ExpectEqual(*store.At(i), *Noise(20, 20, i + 1));
}

}  // namespace
}  // namespace deepuav
