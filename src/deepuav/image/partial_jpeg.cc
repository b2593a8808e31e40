#include "deepuav/image/partial_jpeg.h"

// jpeglib.h needs FILE and size_t to be there.
#include <csetjmp>
#include <cstddef>
#include <cstdio>

#include <jpeglib.h>

namespace deepuav {
namespace {

constexpr uint8_t kMiddleGrey = 128;
constexpr JOCTET kEndOfImage[] = {0xff, 0xd9};

/// libjpeg's own ways print on stderr and end the program.
struct Errors {
  jpeg_error_mgr manager;  // The first member: libjpeg's pointer to it is one to this.
  std::jmp_buf back;
  bool damaged;  // From here on libjpeg makes up what it lacks.
};

[[noreturn]] void GiveUp(j_common_ptr info) {
  std::longjmp(reinterpret_cast<Errors*>(info->err)->back, 1);
}

void NoteDamage(j_common_ptr info, int level) {
  if (level < 0) reinterpret_cast<Errors*>(info->err)->damaged = true;
}

/// Bytes that end are continued by the end of an image.
boolean EndImage(j_decompress_ptr info) {
  info->src->next_input_byte = kEndOfImage;
  info->src->bytes_in_buffer = sizeof(kEndOfImage);
  return TRUE;
}

void Skip(j_decompress_ptr info, long bytes) {
  if (bytes <= 0) return;
  jpeg_source_mgr& manager = *info->src;
  if (static_cast<size_t>(bytes) >= manager.bytes_in_buffer) {
    EndImage(info);
    return;
  }
  manager.next_input_byte += bytes;
  manager.bytes_in_buffer -= static_cast<size_t>(bytes);
}

class Decoder {
 public:
  Decoder(const std::vector<uint8_t>& bytes, JpegColours colours)
      : is_grey_(colours == JpegColours::kGrey) {
    info_.err = jpeg_std_error(&errors_.manager);
    errors_.manager.error_exit = GiveUp;
    errors_.manager.emit_message = NoteDamage;
    errors_.manager.output_message = [](j_common_ptr) {};
    source_.next_input_byte = bytes.data();
    source_.bytes_in_buffer = bytes.size();
    source_.init_source = source_.term_source = [](j_decompress_ptr) {};
    source_.fill_input_buffer = EndImage;
    source_.skip_input_data = Skip;
    source_.resync_to_restart = jpeg_resync_to_restart;
  }
  ~Decoder() { jpeg_destroy_decompress(&info_); }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  /// False where libjpeg gave up. No object with a destructor may live in here: it comes back by a
  /// jump.
  bool Run(int reduction) {
    if (setjmp(errors_.back) != 0) return false;
    jpeg_create_decompress(&info_);
    info_.src = &source_;
    if (jpeg_read_header(&info_, TRUE) != JPEG_HEADER_OK) return false;
    if (jpeg_has_multiple_scans(&info_)) return false;  // All rows are there, none of them sharp.
    info_.out_color_space = is_grey_ ? JCS_GRAYSCALE : JCS_EXT_BGR;
    info_.scale_num = 1;
    info_.scale_denom = static_cast<unsigned>(reduction);
    jpeg_start_decompress(&info_);
    image_.create(static_cast<int>(info_.output_height), static_cast<int>(info_.output_width),
                  is_grey_ ? CV_8UC1 : CV_8UC3);
    image_.setTo(cv::Scalar::all(kMiddleGrey));
    while (info_.output_scanline < info_.output_height && !errors_.damaged) {
      JSAMPROW row = image_.ptr(static_cast<int>(info_.output_scanline));
      jpeg_read_scanlines(&info_, &row, 1);
      if (!errors_.damaged) rows_ = static_cast<int>(info_.output_scanline);
    }
    return true;
  }

  /// After Run(), also where that gave up on the way.
  std::optional<PartialJpeg> Decoded() const {
    if (image_.empty()) return std::nullopt;
    image_.rowRange(rows_, image_.rows).setTo(cv::Scalar::all(kMiddleGrey));
    return PartialJpeg{image_, static_cast<double>(rows_) / image_.rows};
  }

 private:
  jpeg_decompress_struct info_{};
  Errors errors_{};
  jpeg_source_mgr source_{};
  bool is_grey_;
  cv::Mat image_;
  int rows_ = 0;  ///< Decoded before anything was lacking.
};

}  // namespace

std::optional<PartialJpeg> DecodePartialJpeg(const std::vector<uint8_t>& bytes, int reduction,
                                             JpegColours colours) {
  Decoder decoder(bytes, colours);
  decoder.Run(reduction);
  return decoder.Decoded();
}

}  // namespace deepuav
