#include <algorithm>
#include <opencv2/videoio.hpp>

#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/testing/io_test_support.h"
#include "support/fuzzing.h"

namespace deepuav {
namespace {

constexpr int kFrames = 6, kMaxFramesRead = 20;

std::string VideoBytes(const std::filesystem::path& file, int backend, const char (&codec)[5]) {
  cv::VideoWriter writer(file.string(), backend,
                         cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]), 25,
                         cv::Size(64, 48));
  for (int i = 0; i < kFrames; ++i)
    writer.write(cv::Mat3b(48, 64, cv::Vec3b::all(static_cast<uint8_t>(40 * i))));
  writer.release();
  return ReadAll(file);
}

/// Much of a damaged video can still be shown, so few are refused.
TEST(VideoFuzzTest, DamagedContainersAndPictures) {
  const TemporaryFolder folder;
  folder.Write("camera.yaml", kTestCameraYaml);
  std::vector<std::string> seeds = {
      VideoBytes(folder.path() / "seed.avi", cv::CAP_OPENCV_MJPEG, "MJPG")};
  const std::string mp4 = VideoBytes(folder.path() / "seed.mp4", cv::CAP_FFMPEG, "mp4v");
  if (!mp4.empty()) seeds.push_back(mp4);
  Fuzz(
      seeds, 300,
      [&](const std::string& input) {
        const auto dataset = OpenDataset(folder.Write("flight.mp4", input));
        for (int i = 0; i < std::min(dataset->size(), kMaxFramesRead); ++i) {
          const GreyImage image = dataset->Load(i);
          EXPECT_TRUE(image.cols == 64 && image.rows == 48);
        }
      },
      0.02);
}

}  // namespace
}  // namespace deepuav
