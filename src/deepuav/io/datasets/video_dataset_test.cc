#include <opencv2/videoio.hpp>

#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

constexpr int kFrames = 12;

class VideoDatasetTest : public ::testing::Test {
 protected:
  /// Frame i is of grey level 20 i.
  VideoDatasetTest() : video_(folder_.path() / "flight.avi") {
    cv::VideoWriter writer(video_.string(), cv::CAP_OPENCV_MJPEG,
                           cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25, cv::Size(64, 48));
    for (int i = 0; i < kFrames; ++i)
      writer.write(cv::Mat3b(48, 64, cv::Vec3b::all(static_cast<uint8_t>(20 * i))));
  }
  static double Grey(const GreyImage& image) { return cv::mean(image)[0]; }

  TemporaryFolder folder_;
  std::filesystem::path video_;
};

TEST_F(VideoDatasetTest, YieldsFramesInAnyOrder) {
  folder_.Write("flight.yaml", kTestCameraYaml);
  const auto dataset = OpenDataset(video_);
  EXPECT_EQ(dataset->Kind(), "video");
  ASSERT_EQ(dataset->size(), kFrames);
  EXPECT_EQ(dataset->camera().rate_hz, 25);
  EXPECT_EQ(dataset->Time(3).nanoseconds, 120000000);
  EXPECT_EQ(dataset->Name(3), video_.string() + " frame 3");
  for (const int frame : {0, 1, 2, 7, 3, 11, 11, 0}) {
    EXPECT_NEAR(Grey(dataset->Load(frame)), 20 * frame, 3) << frame;
  }
  EXPECT_EQ(ErrorOf([&] { dataset->Load(kFrames); }), "frame 12: expected 0 to 11");
}

TEST_F(VideoDatasetTest, AFrameKeepsItsPixelsWhenTheNextIsLoaded) {
  folder_.Write("camera.yaml", kTestCameraYaml);
  const auto dataset = OpenDataset(video_);
  const GreyImage first = dataset->Load(1);
  dataset->Load(5);
  EXPECT_NEAR(Grey(first), 20, 3);
}

TEST_F(VideoDatasetTest, WithoutACalibrationAGuessIsSaidToBeOne) {
  const auto dataset = OpenDataset(video_);
  EXPECT_EQ(dataset->Calibration().text, "a guess");
  EXPECT_TRUE(dataset->CalibrationIsApproximate());
  EXPECT_EQ(dataset->camera().width, 64);
  EXPECT_EQ(dataset->size(), kFrames);
}

TEST_F(VideoDatasetTest, ACalibrationOfAnotherSizeIsScaledAndOfOtherProportionsRefused) {
  folder_.Write("camera.yaml",
                Replaced(Replaced(Replaced(std::string(kTestCameraYaml), "width: 64", "width: 128"),
                                  "height: 48", "height: 96"),
                         "cx: 31.25", "cx: 63.5"));
  const Camera camera = OpenDataset(video_)->camera();
  EXPECT_EQ(camera.pinhole.fx, 45.5 / 2);
  EXPECT_EQ(camera.pinhole.cx, 31.5);
  const auto file = folder_.Write(
      "camera.yaml", Replaced(std::string(kTestCameraYaml), "height: 48", "height: 50"));
  EXPECT_EQ(ErrorOf([&] { OpenDataset(video_); }), video_.string() +
                                                       ": image is 64x48: expected 64x50 as in " +
                                                       file.string() + ", or the same proportions");
  DatasetOptions options;
  options.camera_file = folder_.Write("other/c.yaml", kTestCameraYaml);
  EXPECT_EQ(OpenDataset(video_, options)->size(), kFrames);
}

TEST_F(VideoDatasetTest, ADamagedContainerIsAnErrorNamingIt) {
  folder_.Write("camera.yaml", kTestCameraYaml);
  const std::string bytes = ReadAll(video_);
  for (const std::string& damaged : {std::string(), std::string("not a video"), bytes.substr(0, 60),
                                     "RIFF" + std::string(5000, '\x55')}) {
    folder_.Write("flight.avi", damaged);
    const std::string message = ErrorOf([&] { OpenDataset(video_); });
    EXPECT_TRUE(message.starts_with(video_.string())) << message;
  }
}

TEST_F(VideoDatasetTest, ATruncatedContainerYieldsWhatIsThere) {
  folder_.Write("camera.yaml", kTestCameraYaml);
  const std::string bytes = ReadAll(video_);
  folder_.Write("flight.avi", bytes.substr(0, bytes.size() * 2 / 3));
  std::unique_ptr<Dataset> dataset;
  try {
    dataset = OpenDataset(video_);
  } catch (const Error& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with(video_.string())) << error.what();
    return;
  }
  EXPECT_NEAR(Grey(dataset->Load(0)), 0, 3);
  int failed = 0;
  for (int i = 0; i < dataset->size(); ++i) {
    try {
      dataset->Load(i);
    } catch (const Error& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with(video_.string() + " frame "))
          << error.what();
      ++failed;
    }
  }
  EXPECT_LT(failed, kFrames);
  EXPECT_TRUE(failed > 0 || dataset->size() < kFrames);
}

TEST_F(VideoDatasetTest, AFrameThatCannotBeDecodedDoesNotShiftThoseAfterIt) {
  std::string bytes = ReadAll(video_);
  constexpr int kLost = 5;
  size_t place = 0;
  for (int i = 0; i <= kLost; ++i) place = bytes.find("\xff\xd8\xff", place + 1);
  const size_t next = bytes.find("\xff\xd8\xff", place + 1);
  ASSERT_NE(next, std::string::npos);
  constexpr size_t kChunkHead = 8;
  std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(place),
            bytes.begin() + static_cast<std::ptrdiff_t>(next - kChunkHead), '\0');
  folder_.Write("flight.avi", bytes);
  const auto dataset = OpenDataset(video_);
  ASSERT_EQ(dataset->size(), kFrames);
  EXPECT_EQ(ErrorOf([&] { dataset->Load(kLost); }),
            video_.string() + " frame 5: cannot be decoded");
  for (int frame : {6, 7, 4}) EXPECT_NEAR(Grey(dataset->Load(frame)), 20 * frame, 3) << frame;
}

TEST_F(VideoDatasetTest, WhereTheLastCannotBeDecodedTheOneBeforeCanBeHadAgain) {
  std::string bytes = ReadAll(video_);
  size_t place = 0;
  for (int i = 0; i < kFrames; ++i) place = bytes.find("\xff\xd8\xff", place + 1);
  ASSERT_NE(place, std::string::npos);
  ASSERT_EQ(bytes.find("\xff\xd8\xff", place + 1), std::string::npos);
  const size_t end = bytes.find("\xff\xd9", place);
  std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(place),
            bytes.begin() + static_cast<std::ptrdiff_t>(end), '\0');
  folder_.Write("flight.avi", bytes);
  const auto dataset = OpenDataset(video_);
  ASSERT_EQ(dataset->size(), kFrames);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(ErrorOf([&] { dataset->Load(kFrames - 1); }),
              fmt::format("{} frame {}: cannot be decoded", video_.string(), kFrames - 1));
    EXPECT_NEAR(Grey(dataset->Load(kFrames - 2)), 20 * (kFrames - 2), 3);
  }
}

/// Pictures of noise that moves, so that they build on one another and every byte counts.
class BuildingVideoTest : public ::testing::Test {
 protected:
  static constexpr int kCount = 36;

  BuildingVideoTest() : video_(folder_.path() / "flight.avi") {
    folder_.Write("camera.yaml", kTestCameraYaml);
    cv::VideoWriter writer(video_.string(), cv::CAP_FFMPEG,
                           cv::VideoWriter::fourcc('X', 'V', 'I', 'D'), 25, cv::Size(64, 48));
    cv::Mat3b noise(48, 64 + kCount);
    cv::RNG random(3);
    random.fill(noise, cv::RNG::UNIFORM, 0, 255);
    for (int i = 0; i < kCount; ++i) writer.write(noise.colRange(i, i + 64));
  }
  int DamagedOfAll() {
    const auto dataset = OpenDataset(video_);
    for (int i = 0; i < dataset->size(); ++i) {
      try {
        dataset->Load(i);
      } catch (const Error&) {  // left out
      }
    }
    return dataset->damaged();
  }

  TemporaryFolder folder_;
  std::filesystem::path video_;
};

TEST_F(VideoDatasetTest, EveryColumnIsOfTheFrame) {
  constexpr int kWidth = 86, kHeight = 50;  // no whole groups of pixels
  const auto file = folder_.path() / "narrow.avi";
  {
    cv::VideoWriter writer(file.string(), cv::CAP_FFMPEG,
                           cv::VideoWriter::fourcc('X', 'V', 'I', 'D'), 25,
                           cv::Size(kWidth, kHeight));
    for (int i = 0; i < kFrames; ++i)
      writer.write(cv::Mat3b(kHeight, kWidth, cv::Vec3b::all(static_cast<uint8_t>(20 * i))));
  }
  const auto dataset = OpenDataset(file);
  for (int i = 0; i < kFrames; ++i) {
    const GreyImage image = dataset->Load(i);
    double least = 0, most = 0;
    cv::minMaxLoc(image, &least, &most);
    EXPECT_NEAR(least, 20 * i, 4) << i;
    EXPECT_NEAR(most, 20 * i, 4) << i;
    const cv::Mat3b colour = dataset->LoadColour(i, cv::Size(kWidth, kHeight));
    EXPECT_TRUE(colour.isContinuous());
    EXPECT_NEAR(cv::mean(colour.col(kWidth - 1))[1], 20 * i, 4) << i;
  }
}

TEST_F(BuildingVideoTest, AWholeOneHasNoDamage) { EXPECT_EQ(DamagedOfAll(), 0); }

TEST_F(BuildingVideoTest, DamageIsToldOfWhatBuildsOnItAndNotOfTheRest) {
  std::string bytes = ReadAll(video_);
  for (size_t i = bytes.size() / 2; i < bytes.size() / 2 + 400; ++i)
    bytes[i] = static_cast<char>(bytes[i] ^ static_cast<char>(37 * i + 11));
  folder_.Write("flight.avi", bytes);
  const auto dataset = OpenDataset(video_);
  dataset->Load(3);
  EXPECT_EQ(dataset->damaged(), 0);
  const int damaged = DamagedOfAll();
  EXPECT_GT(damaged, 1);
  EXPECT_LT(damaged, kCount / 2);
}

TEST_F(BuildingVideoTest, OneCutInsideAGroupYieldsWhatComesBefore) {
  std::vector<GreyImage> whole;
  {
    const auto dataset = OpenDataset(video_);
    for (int i = 0; i < kCount; ++i) whole.push_back(dataset->Load(i).clone());
  }
  const std::string bytes = ReadAll(video_);
  for (const double share : {0.35, 0.5, 0.62, 0.77}) {
    folder_.Write("flight.avi",
                  bytes.substr(0, static_cast<size_t>(share * static_cast<double>(bytes.size()))));
    const auto dataset = OpenDataset(video_);
    int same = 0, told = 0;
    for (int i = 0; i < dataset->size(); ++i) {
      const int damaged_before = dataset->damaged();
      try {
        const GreyImage image = dataset->Load(i);
        ASSERT_EQ(image.size(), cv::Size(64, 48)) << share << ", frame " << i;
        if (cv::norm(image, whole[static_cast<size_t>(i)], cv::NORM_INF) == 0)
          ++same;
        else
          EXPECT_GT(dataset->damaged(), damaged_before) << share << ", frame " << i;
      } catch (const Error& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with(video_.string() + " frame "));
        ++told;
      }
    }
    EXPECT_GT(same, share * kCount / 3) << share;
    EXPECT_TRUE(told > 0 || dataset->damaged() > 0 || dataset->size() < kCount) << share;
  }
}

}  // namespace
}  // namespace deepuav
