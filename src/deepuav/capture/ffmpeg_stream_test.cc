#include "deepuav/capture/ffmpeg_stream.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <opencv2/videoio.hpp>
#include <thread>

#include "deepuav/base/error.h"
#include "deepuav/base/wait.h"
#include "deepuav/io/testing/guarded_images.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

namespace deepuav {
namespace {

constexpr double kTimeout = 10;
constexpr int kRateHz = 50;

std::string FreeAddress() {
  return fmt::format("udp://127.0.0.1:{}", 20'000 + ::getpid() % 20'000);
}

/// Sends a moving picture as MPEG-4 in a transport stream by UDP, of whatever size it is told.
class UdpCamera {
 public:
  explicit UdpCamera(const std::string& address) {
    const std::string target = address + "?pkt_size=1316";
    avformat_alloc_output_context2(&format_, nullptr, "mpegts", target.c_str());
    stream_ = avformat_new_stream(format_, nullptr);
    OpenEncoder(320, 240);
    avcodec_parameters_from_context(stream_->codecpar, encoder_);
    stream_->time_base = encoder_->time_base;
    EXPECT_GE(avio_open(&format_->pb, target.c_str(), AVIO_FLAG_WRITE), 0);
    EXPECT_GE(avformat_write_header(format_, nullptr), 0);
    thread_ = std::thread([this] { Work(); });
  }
  ~UdpCamera() {
    Stop();
    avcodec_free_context(&encoder_);
    avio_closep(&format_->pb);
    avformat_free_context(format_);
  }
  UdpCamera(const UdpCamera&) = delete;
  UdpCamera& operator=(const UdpCamera&) = delete;

  void Halve() { halved_ = true; }
  void Stop() {
    stopped_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  void OpenEncoder(int width, int height) {
    avcodec_free_context(&encoder_);
    const AVCodec* codec = avcodec_find_encoder(AV_CODEC_ID_MPEG4);
    encoder_ = avcodec_alloc_context3(codec);
    encoder_->width = width;
    encoder_->height = height;
    encoder_->pix_fmt = AV_PIX_FMT_YUV420P;
    encoder_->time_base = {1, kRateHz};
    encoder_->gop_size = 5;
    encoder_->bit_rate = 4'000'000;
    EXPECT_GE(avcodec_open2(encoder_, codec, nullptr), 0);
  }

  void SendImage(int index) {
    AVFrame* frame = av_frame_alloc();
    frame->format = encoder_->pix_fmt;
    frame->width = encoder_->width;
    frame->height = encoder_->height;
    frame->pts = index;
    av_frame_get_buffer(frame, 0);
    constexpr int kSquare = 32;
    constexpr uint8_t kDark = 20, kLight = 230;
    for (int y = 0; y < frame->height; ++y) {
      for (int x = 0; x < frame->width; ++x) {
        const bool is_light = ((x + index) / kSquare + y / kSquare) % 2 == 0;
        frame->data[0][y * frame->linesize[0] + x] = is_light ? kLight : kDark;
      }
    }
    for (int plane : {1, 2})
      std::fill_n(frame->data[plane], frame->linesize[plane] * frame->height / 2, uint8_t{128});
    avcodec_send_frame(encoder_, frame);
    av_frame_free(&frame);
    AVPacket* packet = av_packet_alloc();
    while (avcodec_receive_packet(encoder_, packet) >= 0) {
      av_packet_rescale_ts(packet, encoder_->time_base, stream_->time_base);
      packet->stream_index = 0;
      av_interleaved_write_frame(format_, packet);
    }
    av_packet_free(&packet);
  }

  void Work() {
    for (int index = 0; !stopped_; ++index) {
      if (halved_ && encoder_->width == 320) OpenEncoder(160, 120);
      SendImage(index);
      WaitUnless([this] { return stopped_.load(); }, 1.0 / kRateHz);
    }
  }

  AVFormatContext* format_ = nullptr;
  AVStream* stream_ = nullptr;
  AVCodecContext* encoder_ = nullptr;
  std::atomic<bool> stopped_{false}, halved_{false};
  std::thread thread_;
};

/// The next image of that width; the stream's times must grow until then.
std::optional<LiveImage> NextOfWidth(int width, FfmpegStream* stream, Timestamp* last) {
  const Stopwatch waiting;
  while (waiting.Seconds() < kTimeout) {
    std::optional<LiveImage> image = stream->Next({});
    if (!image) return std::nullopt;
    EXPECT_TRUE(image->stream_time && *image->stream_time > *last);
    *last = *image->stream_time;
    if (image->image.cols == width) return image;
  }
  return std::nullopt;
}

TEST(FfmpegStream, ReadsUdpWhateverTheSizeAndEndsWhereNothingComes) {
  const std::string address = FreeAddress();
  UdpCamera camera(address);
  FfmpegStream stream(address, address, kTimeout, {});
  Timestamp last{-1};
  const auto first = NextOfWidth(320, &stream, &last);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->image.rows, 240);
  double low = 0, high = 0;
  cv::minMaxLoc(first->image, &low, &high);
  EXPECT_LT(low, 40);
  EXPECT_GT(high, 200);
  camera.Halve();
  const auto second = NextOfWidth(160, &stream, &last);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->image.rows, 120);
  camera.Stop();
  const Stopwatch stopping;
  while (stream.Next([&] { return stopping.Seconds() > 0.3; })) {
  }
  EXPECT_LT(stopping.Seconds(), kTimeout / 2) << "a stop is heeded while nothing comes";
}

/// A file of grey pictures, gone with the object.
class GreyVideo {
 public:
  explicit GreyVideo(const cv::Size& size)
      : file_(std::filesystem::path(testing::TempDir()) /
              fmt::format("deepuav_grey_{}.avi", ::getpid())) {
    cv::VideoWriter writer(file_.string(), cv::CAP_FFMPEG,
                           cv::VideoWriter::fourcc('X', 'V', 'I', 'D'), 25, size);
    for (int i = 0; i < kPictures; ++i) writer.write(cv::Mat3b(size, cv::Vec3b::all(kLevel)));
  }
  ~GreyVideo() { std::filesystem::remove(file_); }
  GreyVideo(const GreyVideo&) = delete;
  GreyVideo& operator=(const GreyVideo&) = delete;

  static constexpr int kPictures = 40;
  static constexpr uint8_t kLevel = 120;
  std::string address() const { return file_.string(); }

 private:
  const std::filesystem::path file_;
};

TEST(FfmpegStream, FillsEveryColumnAndNothingBeyondWhateverTheWidth) {
  GuardedImages images;
  for (const int width : {846, 322, 500, 4, 2}) {
    const cv::Size size(width, 50);
    const GreyVideo video(size);
    FfmpegStream stream(video.address(), video.address(), kTimeout, {});
    int pictures = 0;
    for (; const auto image = stream.Next({}); ++pictures) {
      ASSERT_EQ(image->image.size(), size);
      EXPECT_TRUE(image->image.isContinuous());
      double low = 0, high = 0;
      cv::minMaxLoc(image->image, &low, &high);
      EXPECT_NEAR(low, GreyVideo::kLevel, 2) << width;
      EXPECT_NEAR(high, GreyVideo::kLevel, 2) << width;
    }
    EXPECT_EQ(pictures, GreyVideo::kPictures) << width;
  }
  EXPECT_EQ(images.overrun(), 0);
}

TEST(FfmpegStream, IsGivenUpAfterTheTimeout) {
  const Stopwatch waiting;
  constexpr double kShort = 0.3;
  EXPECT_THROW(FfmpegStream(FreeAddress(), "nobody", kShort, {}), Error);
  EXPECT_LT(waiting.Seconds(), kTimeout / 2);
}

}  // namespace
}  // namespace deepuav
