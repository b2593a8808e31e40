#include "deepuav/capture/ffmpeg_stream.h"

#include <algorithm>
#include <iterator>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/io/datasets/ffmpeg_handles.h"
#include "deepuav/io/datasets/frame_converter.h"

namespace deepuav {
namespace {

/// What it sends is of this moment whoever asks. Others, as a server of files, begin with what they
/// have, whose first images may be all for long that need no earlier one.
bool IsOfTheMoment(const std::string& address) {
  constexpr std::string_view kSchemes[] = {"rtsp", "rtsps", "rtp", "srtp", "udp", "srt"};
  const std::string_view scheme = std::string_view(address).substr(0, address.find("://"));
  return std::ranges::find(kSchemes, scheme) != std::end(kSchemes) || address.ends_with(".sdp");
}

/// Images of the moment are handed on at once: what came while the stream was opened is passed
/// over. A session description, a file, leads to the network.
AVDictionary* OptionsFor(const std::string& address) {
  AVDictionary* options = nullptr;
  av_dict_set(&options, "rtsp_transport", "tcp", 0);
  if (IsOfTheMoment(address)) av_dict_set(&options, "fflags", "nobuffer", 0);
  if (address.ends_with(".sdp")) av_dict_set(&options, "protocol_whitelist", "file,rtp,udp", 0);
  return options;
}

}  // namespace

class FfmpegStream::Reader {
 public:
  explicit Reader(double timeout_s) : timeout_s_(timeout_s) {}

  bool Open(const std::string& address, const std::function<bool()>& stop);
  std::optional<LiveImage> Next(const std::function<bool()>& stop);

 private:
  static int IsToEnd(void* self);
  bool OpenDecoder();
  /// False at the end.
  bool FeedDecoder();
  std::optional<GreyImage> Grey();

  const double timeout_s_;
  Stopwatch since_asked_;
  const std::function<bool()>* stop_ = nullptr;
  FfmpegOwned<AVFormatContext> format_;
  FfmpegOwned<AVCodecContext> codec_;
  FfmpegOwned<AVPacket> packet_{av_packet_alloc()};
  FfmpegOwned<AVFrame> frame_{av_frame_alloc()};
  FrameConverter to_grey_{FrameConverter::Pixels::kGrey};
  int stream_ = -1;
  Stopwatch since_open_;
  bool is_whole_ =
      false;  ///< An image that needs no earlier one has come: until then they are grey.
};

int FfmpegStream::Reader::IsToEnd(void* self) {
  const auto* reader = static_cast<const Reader*>(self);
  const bool stopped = reader->stop_ && *reader->stop_ && (*reader->stop_)();
  return stopped || reader->since_asked_.Seconds() > reader->timeout_s_ ? 1 : 0;
}

bool FfmpegStream::Reader::Open(const std::string& address, const std::function<bool()>& stop) {
  stop_ = &stop;
  since_asked_.Restart();
  AVFormatContext* format = avformat_alloc_context();
  format->interrupt_callback = {&IsToEnd, this};
  AVDictionary* options = OptionsFor(address);
  const int opened = avformat_open_input(&format, address.c_str(), nullptr, &options);
  av_dict_free(&options);
  if (opened < 0) return false;  // Then the context is freed.
  format_.reset(format);
  const bool is_found = avformat_find_stream_info(format, nullptr) >= 0 && OpenDecoder();
  stop_ = nullptr;
  since_open_.Restart();
  return is_found;
}

bool FfmpegStream::Reader::OpenDecoder() {
  const AVCodec* decoder = nullptr;
  stream_ = av_find_best_stream(format_.get(), AVMEDIA_TYPE_VIDEO, -1, -1, &decoder, 0);
  if (stream_ < 0 || !decoder) return false;
  codec_.reset(avcodec_alloc_context3(decoder));
  codec_->flags |= AV_CODEC_FLAG_LOW_DELAY;
  codec_->thread_count = 1;  // Threads would each hold an image back.
  return avcodec_parameters_to_context(codec_.get(), format_->streams[stream_]->codecpar) >= 0 &&
         avcodec_open2(codec_.get(), decoder, nullptr) >= 0;
}

bool FfmpegStream::Reader::FeedDecoder() {
  if (av_read_frame(format_.get(), packet_.get()) < 0) return false;
  if (packet_->stream_index == stream_) {
    constexpr double kLongestWait = 5;  // Seconds: some streams mark none.
    is_whole_ |= (packet_->flags & AV_PKT_FLAG_KEY) != 0 || since_open_.Seconds() > kLongestWait;
    // What it cannot decode is left out.
    if (is_whole_) avcodec_send_packet(codec_.get(), packet_.get());
  }
  av_packet_unref(packet_.get());
  return true;
}

std::optional<GreyImage> FfmpegStream::Reader::Grey() {
  if ((frame_->flags & AV_FRAME_FLAG_CORRUPT) != 0) return std::nullopt;
  const cv::Mat grey = to_grey_.Convert(*frame_);
  if (grey.empty()) return std::nullopt;
  return GreyImage(grey.clone());  // Its rows had room between them.
}

std::optional<LiveImage> FfmpegStream::Reader::Next(const std::function<bool()>& stop) {
  stop_ = &stop;
  since_asked_.Restart();
  std::optional<LiveImage> next;
  while (!next) {
    const int received = avcodec_receive_frame(codec_.get(), frame_.get());
    if (received < 0) {
      if (received == AVERROR_EOF || IsToEnd(this) != 0 || !FeedDecoder()) break;
      continue;
    }
    if (std::optional<GreyImage> grey = Grey()) {
      next.emplace(LiveImage{std::move(*grey), std::nullopt});
      constexpr AVRational kNanoseconds = {1, 1'000'000'000};
      if (frame_->best_effort_timestamp != AV_NOPTS_VALUE)
        next->stream_time = Timestamp{av_rescale_q(
            frame_->best_effort_timestamp, format_->streams[stream_]->time_base, kNanoseconds)};
    }
    av_frame_unref(frame_.get());
  }
  stop_ = nullptr;
  return next;
}

FfmpegStream::FfmpegStream(const std::string& address, const std::string& name, double timeout_s,
                           const std::function<bool()>& stop)
    : reader_(std::make_unique<Reader>(timeout_s)) {
  av_log_set_level(AV_LOG_QUIET);  // What is wrong with a stream is told by who reads it.
  if (!reader_->Open(address, stop))
    throw Error("{}: cannot be opened: expected a stream that gives images", name);
}

FfmpegStream::~FfmpegStream() = default;

std::optional<LiveImage> FfmpegStream::Next(const std::function<bool()>& stop) {
  return reader_->Next(stop);
}

}  // namespace deepuav
