#include "arguments/option_bounds_check.h"

#include "deepuav/io/files/text_file.h"

namespace deepuav {

CLI::Validator WithinBounds(const NumberBounds& bounds) {
  return CLI::Validator(
      [bounds](const std::string& text) {
        double number = 0;
        if (IsNumber(text, &number) && bounds.Hold(number)) return std::string();
        return fmt::format("{}: expected {}", Quoted(text), bounds.Text());
      },
      "");
}

}  // namespace deepuav
