#include "deepuav/io/datasets/frame_converter.h"

#include <gtest/gtest.h>

#include "deepuav/io/testing/guarded_images.h"

namespace deepuav {
namespace {

constexpr int kHeight = 51;
constexpr int kNarrow = 2, kWidths[] = {846, 322, 500, kNarrow};  // no whole groups of pixels
constexpr AVPixelFormat kFormats[] = {AV_PIX_FMT_YUV420P, AV_PIX_FMT_YUVJ422P, AV_PIX_FMT_YUYV422,
                                      AV_PIX_FMT_BGR24, AV_PIX_FMT_GRAY8};
constexpr uint8_t kLevel = 120;

FfmpegOwned<AVFrame> UniformFrame(AVPixelFormat format, int width) {
  FfmpegOwned<AVFrame> frame(av_frame_alloc());
  frame->format = format;
  frame->width = width;
  frame->height = kHeight;
  EXPECT_GE(av_frame_get_buffer(frame.get(), 0), 0);
  for (int plane = 0; frame->buf[plane]; ++plane)
    std::fill_n(frame->buf[plane]->data, frame->buf[plane]->size, kLevel);
  return frame;
}

/// The first column may be trusted: it begins a group.
void ExpectUniform(const cv::Mat& image) {
  for (int column = 1; column < image.cols; ++column)
    ASSERT_EQ(cv::norm(image.col(column), image.col(0), cv::NORM_INF), 0) << column;
}

TEST(FrameConverter, EveryColumnIsOfThePictureAndNothingBeyondIt) {
  GuardedImages images;
  for (const auto pixels : {FrameConverter::Pixels::kGrey, FrameConverter::Pixels::kBgr}) {
    FrameConverter converter(pixels);
    for (const AVPixelFormat format : kFormats) {
      for (const int width : kWidths) {
        const FfmpegOwned<AVFrame> frame = UniformFrame(format, width);
        const cv::Mat image = converter.Convert(*frame);
        SCOPED_TRACE(testing::Message() << "format " << format << ", width " << width);
        ASSERT_EQ(image.size(), cv::Size(width, kHeight));
        ASSERT_EQ(image.channels(), pixels == FrameConverter::Pixels::kGrey ? 1 : 3);
        ExpectUniform(image);
      }
    }
  }
  EXPECT_EQ(images.overrun(), 0);
}

TEST(FrameConverter, GivesNothingForASizeThatIsNone) {
  FrameConverter converter(FrameConverter::Pixels::kGrey);
  const FfmpegOwned<AVFrame> frame = UniformFrame(AV_PIX_FMT_YUV420P, kNarrow);
  frame->width = 0;
  EXPECT_TRUE(converter.Convert(*frame).empty());
}

}  // namespace
}  // namespace deepuav
