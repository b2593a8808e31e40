#include "deepuav/io/cameras/xmp_lens.h"

#include <algorithm>
#include <vector>

#include "deepuav/io/cameras/xmp_fields.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

/// Empty where one of them is no number.
std::vector<double> Numbers(std::string_view text) {
  std::vector<std::string_view> fields;
  SplitAtCommas(text, &fields);
  std::vector<double> numbers;
  for (std::string_view field : fields) {
    if (field.starts_with('+')) field.remove_prefix(1);
    if (!IsNumber(field, &numbers.emplace_back())) return {};
  }
  return numbers;
}

std::optional<MeasuredLens> DewarpData(std::string_view head) {
  constexpr size_t kPlain = 9, kWithK6 = 12;
  std::vector<double> v;
  for (const char* name : {"drone-dji:DewarpData", "drone-dji:DewarpDataK6"}) {
    const std::string value = XmpText(head, name);
    std::string_view text = value;
    if (const size_t date_end = text.find(';'); date_end != std::string_view::npos)
      text.remove_prefix(date_end + 1);
    v = Numbers(text);
    if (v.size() == kPlain || v.size() == kWithK6) break;
  }
  if (v.size() != kPlain && v.size() != kWithK6) return std::nullopt;
  v.resize(kWithK6);
  MeasuredLens lens;
  lens.fx = v[0];
  lens.fy = v[1];
  lens.centre = {v[2], v[3]};
  lens.radial = {v[4], v[5], v[8], v[9], v[10], v[11]};
  lens.p1 = v[6];
  lens.p2 = v[7];
  lens.is_undone = XmpNumber(head, "drone-dji:DewarpFlag").value_or(0) == 1;
  return lens;
}

std::optional<MeasuredLens> Perspective(std::string_view head) {
  const auto focal = XmpNumber(head, "Camera:PerspectiveFocalLength");
  const std::string model = XmpText(head, "Camera:ModelType");
  const std::string unit = XmpText(head, "Camera:PerspectiveFocalLengthUnits");
  const std::vector<double> centre = Numbers(XmpText(head, "Camera:PrincipalPoint"));
  const std::vector<double> d = Numbers(XmpText(head, "Camera:PerspectiveDistortion"));
  // The principal point is in mm, whatever the focal length is in.
  if (!focal || unit != "mm" || model == "fisheye" || centre.size() != 2 || d.size() != 5)
    return std::nullopt;
  MeasuredLens lens;
  lens.in_mm = lens.is_centre_from_corner = true;
  lens.fx = lens.fy = *focal;
  lens.centre = {centre[0], centre[1]};
  lens.radial = {d[0], d[1], d[2], 0, 0, 0};
  lens.p1 = d[3];
  lens.p2 = d[4];
  return lens;
}

}  // namespace

std::optional<XmpLens> ParseXmpLens(std::string_view head) {
  XmpLens lens;
  lens.focal_px = std::max(0.0, XmpNumber(head, "drone-dji:CalibratedFocalLength").value_or(0));
  lens.cx_px = XmpNumber(head, "drone-dji:CalibratedOpticalCenterX");
  lens.cy_px = XmpNumber(head, "drone-dji:CalibratedOpticalCenterY");
  lens.measured = DewarpData(head);
  if (!lens.measured) lens.measured = Perspective(head);
  if (lens.focal_px == 0 && !lens.measured) return std::nullopt;
  return lens;
}

std::string ParseXmpBand(std::string_view head) {
  constexpr size_t kMostBytes = 40;
  for (const char* name : {"Camera:BandName", "drone-dji:BandName"}) {
    const std::string band = XmpText(head, name);
    const bool is_colour = band == "RGB" || band.find(',') != std::string::npos;
    if (!band.empty()) return is_colour ? "" : OneLine(band.substr(0, kMostBytes));
  }
  return {};
}

}  // namespace deepuav
