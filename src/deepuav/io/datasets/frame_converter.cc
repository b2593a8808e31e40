#include "deepuav/io/datasets/frame_converter.h"

extern "C" {
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <iterator>

#include "deepuav/io/cameras/camera_file.h"

namespace deepuav {
namespace {

/// FFmpeg converts so many pixels of a row at a time, and may write beyond its end.
constexpr int kGroupPx = 16;

int WholeGroups(int width) { return (width + kGroupPx - 1) / kGroupPx * kGroupPx; }

/// Its quick converters leave what is no whole group as it was. They look at no pixel's neighbours,
/// so what lies beyond the picture does no harm. Others convert every pixel.
int ConvertedWidth(const AVFrame& frame) {
  constexpr AVPixelFormat kQuick[] = {AV_PIX_FMT_YUV420P, AV_PIX_FMT_YUVJ420P, AV_PIX_FMT_YUV422P,
                                      AV_PIX_FMT_YUVJ422P};
  const int whole = WholeGroups(frame.width);
  const bool is_quick =
      std::find(std::begin(kQuick), std::end(kQuick), frame.format) != std::end(kQuick);
  const bool has_room = frame.linesize[0] >= whole && frame.linesize[1] >= whole / 2 &&
                        frame.linesize[2] >= whole / 2;
  return is_quick && has_room ? whole : frame.width;
}

}  // namespace

FrameConverter::~FrameConverter() { sws_freeContext(context_); }

cv::Mat FrameConverter::Convert(const AVFrame& frame) {
  const int width = frame.width, height = frame.height;
  if (width <= 0 || height <= 0 || width > kMaxImageSidePx || height > kMaxImageSidePx) return {};
  const bool is_grey = pixels_ == Pixels::kGrey;
  const int converted = ConvertedWidth(frame);
  context_ =
      sws_getCachedContext(context_, converted, height, static_cast<AVPixelFormat>(frame.format),
                           converted, height, is_grey ? AV_PIX_FMT_GRAY8 : AV_PIX_FMT_BGR24,
                           is_grey ? SWS_POINT : SWS_BICUBIC, nullptr, nullptr, nullptr);
  if (!context_) return {};
  cv::Mat image(height, WholeGroups(width) + kGroupPx, is_grey ? CV_8UC1 : CV_8UC3);
  uint8_t* const rows[] = {image.data};
  const int strides[] = {static_cast<int>(image.step)};
  sws_scale(context_, frame.data, frame.linesize, 0, height, rows, strides);
  return image.colRange(0, width);
}

}  // namespace deepuav
