#include "deepuav/io/datasets/kitti_calibration.h"

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {

Pinhole ReadKittiCalibration(const std::filesystem::path& file) {
  const TextFile text(file);
  std::vector<std::string_view> fields;
  for (const TextLine& line : text.lines()) {
    if (!line.text.starts_with("P0:")) continue;
    const std::string where = text.Where(line);
    SplitAtBlanks(line.text.substr(3), &fields);
    if (fields.size() != 12) {
      throw Error("{}: P0 holds {} numbers: expected 12, a 3x4 matrix by rows", where,
                  fields.size());
    }
    double p[12];
    for (size_t i = 0; i < 12; ++i) p[i] = ParseFinite(fields[i], where, fmt::format("P0[{}]", i));
    if (p[1] != 0 || p[4] != 0 || p[8] != 0 || p[9] != 0 || p[10] != 1) {
      throw Error(
          "{}: P0 is no projection of a rectified camera: expected fx 0 cx . 0 fy cy . 0 0 1 .",
          where);
    }
    return {p[0], p[5], p[2], p[6]};
  }
  throw Error("{}: line 'P0:' is missing: expected the projection of camera 0", file.string());
}

}  // namespace deepuav
