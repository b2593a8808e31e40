#include "deepuav/io/datasets/video_file.h"

extern "C" {
#include <libavutil/display.h>
}

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "deepuav/base/error.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/datasets/ffmpeg_handles.h"
#include "deepuav/io/datasets/frame_converter.h"

namespace deepuav {
namespace {

constexpr AVRational kNanoseconds = {1, 1'000'000'000};

}  // namespace

class VideoFile::Reader {
 public:
  Reader(const std::filesystem::path& file, const DamageOptions& damage)
      : file_(file), damage_options_(damage) {
    Open();
  }

  void Open();
  Packets ReadPackets();
  std::optional<Picture> Next();
  cv::Mat Pixels();
  const AVStream& stream() const { return *format_->streams[stream_]; }
  int width() const { return codec_->width; }
  int height() const { return codec_->height; }

 private:
  void OpenDecoder();
  struct Decoded {
    FfmpegOwned<AVFrame> frame;
    Picture picture;
  };
  std::optional<int64_t> Nanoseconds(int64_t ticks) const;
  /// False once the decoder has been told that nothing follows.
  bool FeedDecoder();
  /// False at the end.
  bool Decode();
  void Judge(FfmpegOwned<AVFrame> frame);
  /// Pictures to be decoded before one is given.
  size_t PicturesAhead() const;

  const std::filesystem::path file_;
  const DamageOptions damage_options_;
  FfmpegOwned<AVFormatContext> format_;
  FfmpegOwned<AVCodecContext> codec_;
  FfmpegOwned<AVPacket> packet_{av_packet_alloc()};
  std::deque<Decoded> decoded_;  ///< That given last, and what is shown after it.
  FrameConverter to_bgr_{FrameConverter::Pixels::kBgr};
  int stream_ = -1;
  bool is_drained_ = false;
  bool is_in_hand_ = false;  ///< The first of decoded_ was given.
  DamageWatch damage_{damage_options_};
};

void VideoFile::Reader::Open() {
  av_log_set_level(AV_LOG_QUIET);  // What is wrong with a video is told by who reads it.
  codec_.reset();
  format_.reset();
  is_drained_ = false;
  decoded_.clear();
  is_in_hand_ = false;
  damage_ = DamageWatch(damage_options_);
  AVFormatContext* format = nullptr;
  if (avformat_open_input(&format, file_.c_str(), nullptr, nullptr) < 0) {
    throw Error("{}: cannot be opened as a video: expected a container that FFmpeg reads",
                file_.string());
  }
  format_.reset(format);
  if (avformat_find_stream_info(format, nullptr) < 0)
    throw Error("{}: no picture can be decoded: the video is damaged", file_.string());
  OpenDecoder();
}

void VideoFile::Reader::OpenDecoder() {
  const AVCodec* decoder = nullptr;
  stream_ = av_find_best_stream(format_.get(), AVMEDIA_TYPE_VIDEO, -1, -1, &decoder, 0);
  if (stream_ < 0 || !decoder)
    throw Error("{}: expected a video stream that FFmpeg decodes", file_.string());
  codec_.reset(avcodec_alloc_context3(decoder));
  codec_->thread_count = 0;  // As many as there are processors.
  if (avcodec_parameters_to_context(codec_.get(), stream().codecpar) < 0 ||
      avcodec_open2(codec_.get(), decoder, nullptr) < 0)
    throw Error("{}: FFmpeg's decoder {} does not take it", file_.string(), decoder->name);
  const int width = codec_->width, height = codec_->height;
  if (width <= 0 || height <= 0) {
    throw Error("{}: no picture can be decoded: the video is damaged or cut before its first one",
                file_.string());
  }
  if (width > kMaxImageSidePx || height > kMaxImageSidePx) {
    throw Error("{}: pictures are {}x{}: expected at most {} on a side", file_.string(), width,
                height, kMaxImageSidePx);
  }
}

std::optional<int64_t> VideoFile::Reader::Nanoseconds(int64_t ticks) const {
  if (ticks == AV_NOPTS_VALUE) return std::nullopt;
  return av_rescale_q(ticks, stream().time_base, kNanoseconds);
}

VideoFile::Packets VideoFile::Reader::ReadPackets() {
  Packets packets;
  std::vector<int64_t>& shown_ns = packets.shown_ns;
  bool all_say = true;
  while (av_read_frame(format_.get(), packet_.get()) >= 0) {
    if (packet_->stream_index == stream_) {
      const auto time = Nanoseconds(packet_->pts != AV_NOPTS_VALUE ? packet_->pts : packet_->dts);
      all_say &= time.has_value();
      shown_ns.push_back(time.value_or(0));
      ++packets.count;
    }
    av_packet_unref(packet_.get());
  }
  Open();
  std::sort(shown_ns.begin(), shown_ns.end());  // Packets come in the order of decoding.
  const bool grows = std::adjacent_find(shown_ns.begin(), shown_ns.end()) == shown_ns.end();
  if (!all_say || !grows) shown_ns.clear();
  return packets;
}

bool VideoFile::Reader::FeedDecoder() {
  if (is_drained_) return false;
  while (av_read_frame(format_.get(), packet_.get()) >= 0) {
    const bool is_ours = packet_->stream_index == stream_;
    if (is_ours && avcodec_send_packet(codec_.get(), packet_.get()) < 0) damage_.Lost();
    av_packet_unref(packet_.get());
    if (is_ours) return true;
  }
  is_drained_ = true;
  avcodec_send_packet(codec_.get(), nullptr);
  return true;
}

std::optional<VideoFile::Picture> VideoFile::Reader::Next() {
  if (std::exchange(is_in_hand_, true)) decoded_.pop_front();
  while (decoded_.size() <= PicturesAhead() && Decode()) {
  }
  if (!decoded_.empty()) return decoded_.front().picture;
  is_in_hand_ = false;
  return std::nullopt;
}

/// What is shown before a picture may build on it.
size_t VideoFile::Reader::PicturesAhead() const {
  return codec_->has_b_frames > 0 ? static_cast<size_t>(damage_options_.pictures_ahead) : 0;
}

bool VideoFile::Reader::Decode() {
  FfmpegOwned<AVFrame> frame(av_frame_alloc());
  while (true) {
    const int received = avcodec_receive_frame(codec_.get(), frame.get());
    if (received >= 0) break;
    if (received == AVERROR_EOF) return false;
    if (received != AVERROR(EAGAIN)) damage_.Lost();
    if (!FeedDecoder()) return false;
  }
  Judge(std::move(frame));
  return true;
}

void VideoFile::Reader::Judge(FfmpegOwned<AVFrame> frame) {
  Picture picture;
  picture.shown_ns = Nanoseconds(frame->best_effort_timestamp);
  const bool contradicts =
      (frame->flags & AV_FRAME_FLAG_CORRUPT) != 0 || frame->decode_error_flags != 0;
  picture.is_damaged = damage_.Judge(contradicts, frame->key_frame != 0, picture.shown_ns);
  if (contradicts) {
    for (auto before = decoded_.rbegin();
         before != decoded_.rend() && before->frame->pict_type == AV_PICTURE_TYPE_B; ++before)
      before->picture.is_damaged = true;
  }
  decoded_.push_back({std::move(frame), picture});
}

cv::Mat VideoFile::Reader::Pixels() {
  return decoded_.empty() ? cv::Mat() : to_bgr_.Convert(*decoded_.front().frame);
}

VideoFile::VideoFile(const std::filesystem::path& file, const DamageOptions& damage)
    : reader_(std::make_unique<Reader>(file, damage)) {}

VideoFile::~VideoFile() = default;

int VideoFile::width() const { return reader_->width(); }

int VideoFile::height() const { return reader_->height(); }

double VideoFile::rate_hz() const {
  const AVStream& stream = reader_->stream();
  const AVRational rate =
      stream.avg_frame_rate.num > 0 ? stream.avg_frame_rate : stream.r_frame_rate;
  return rate.num > 0 && rate.den > 0 ? av_q2d(rate) : 0;
}

int VideoFile::rotation_deg() const {
  const uint8_t* matrix =
      av_stream_get_side_data(&reader_->stream(), AV_PKT_DATA_DISPLAYMATRIX, nullptr);
  if (!matrix) return 0;
  constexpr int kQuarter = 90, kFull = 360;
  // FFmpeg counts against the clock.
  const double turned = -av_display_rotation_get(reinterpret_cast<const int32_t*>(matrix));
  if (!std::isfinite(turned)) return 0;
  const int quarters = static_cast<int>(std::lround(turned / kQuarter));
  return ((quarters * kQuarter) % kFull + kFull) % kFull;
}

VideoFile::Packets VideoFile::ReadPackets() { return reader_->ReadPackets(); }

void VideoFile::Rewind() { reader_->Open(); }

std::optional<VideoFile::Picture> VideoFile::Next() { return reader_->Next(); }

cv::Mat VideoFile::Pixels() { return reader_->Pixels(); }

}  // namespace deepuav
