#include "deepuav/io/geodata/trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/io/files/atomic_file.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/maps/rigid_matrix.h"

namespace deepuav {
namespace {

enum class Format { kTum, kEuroc, kKitti };

constexpr size_t kTumFields = 8, kEurocFields = 8, kKittiFields = 12;
constexpr int64_t kNanosecondsPerSecond = 1000000000;

// A rounded quaternion is not quite of length one; one further off is no rotation but a mistake.
constexpr double kUnitTolerance = 0.01;

using Fields = std::vector<std::string_view>;

Format FormatOf(const TextLine& line, const std::string& where) {
  Fields fields;
  SplitAtBlanks(line.text, &fields);
  const bool has_decimal_commas = std::ranges::any_of(fields, HasDecimalComma);
  if (line.text.find(',') != std::string_view::npos && !has_decimal_commas) return Format::kEuroc;
  if (fields.size() == kTumFields) return Format::kTum;
  if (fields.size() == kKittiFields) return Format::kKitti;
  throw Error(
      "{}: {} fields in {}: expected TUM (seconds tx ty tz qx qy qz qw), EuRoC "
      "(ns,px,py,pz,qw,qx,qy,qz) or KITTI "
      "(12 numbers)",
      where, fields.size(), Quoted(line.text));
}

void RequireCount(const Fields& fields, bool right, const char* expected,
                  const std::string& where) {
  if (!right) throw Error("{}: {} fields: expected {}", where, fields.size(), expected);
}

// Fields 1 to 3 are the position, 4 to 7 the quaternion, whose real part is at `real_index`.
SE3 ParsePose(const Fields& fields, size_t real_index, const std::string& where) {
  std::array<double, 7> values{};
  for (size_t i = 0; i < values.size(); ++i) {
    values[i] = ParseFinite(fields[i + 1], where, fmt::format("field {}", i + 2));
  }
  const Eigen::Quaterniond rotation =
      real_index == 4 ? Eigen::Quaterniond(values[3], values[4], values[5], values[6])
                      : Eigen::Quaterniond(values[6], values[3], values[4], values[5]);
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1) < kUnitTolerance)) {
    throw Error("{}: the quaternion has length {}: expected 1", where, norm);
  }
  return SE3(rotation, Eigen::Vector3d(values[0], values[1], values[2]));
}

SE3 ParseKittiPose(const Fields& fields, const std::string& where) {
  std::array<double, kKittiFields> rows{};
  for (size_t i = 0; i < rows.size(); ++i) {
    rows[i] = ParseFinite(fields[i], where, fmt::format("field {}", i + 1));
  }
  return RigidFromRows(rows, where, "the pose");
}

TimedPose ParseLine(const TextLine& line, Format format, size_t index, const std::string& where,
                    Fields* fields) {
  if (format == Format::kEuroc) {
    SplitAtCommas(line.text, fields);
    RequireCount(*fields, fields->size() >= kEurocFields, "at least 8 (ns,px,py,pz,qw,qx,qy,qz)",
                 where);
    return {ParseNanoseconds((*fields)[0], where), ParsePose(*fields, 4, where)};
  }
  SplitAtBlanks(line.text, fields);
  if (format == Format::kTum) {
    RequireCount(*fields, fields->size() == kTumFields, "8 (seconds tx ty tz qx qy qz qw)", where);
    return {ParseSeconds((*fields)[0], where), ParsePose(*fields, 7, where)};
  }
  RequireCount(*fields, fields->size() == kKittiFields, "12 ([R | t] by rows)", where);
  const auto whole_seconds = static_cast<int64_t>(index);
  return {Timestamp{whole_seconds * kNanosecondsPerSecond}, ParseKittiPose(*fields, where)};
}

void CheckOrder(const Trajectory& trajectory, Timestamp time, const std::string& where) {
  if (trajectory.empty() || trajectory.back().time < time) return;
  throw Error(
      "{}: time stamp {} ns does not come after the one before, {} ns: expected growing times",
      where, time.nanoseconds, trajectory.back().time.nanoseconds);
}

void SetTimes(const std::filesystem::path& times, const std::filesystem::path& poses,
              Trajectory* trajectory) {
  const TextFile text(times);
  if (text.lines().size() != trajectory->size()) {
    throw Error("{}: holds {} times: expected {}, one for each pose of {}", times.string(),
                text.lines().size(), trajectory->size(), poses.string());
  }
  for (size_t i = 0; i < trajectory->size(); ++i) {
    const std::string where = text.Where(text.lines()[i]);
    (*trajectory)[i].time = ParseSeconds(text.lines()[i].text, where);
    if (i > 0 && (*trajectory)[i].time <= (*trajectory)[i - 1].time) {
      throw Error("{}: the time does not come after the one before: expected growing times", where);
    }
  }
}

Format FormatOf(const TextFile& text, const std::filesystem::path& file) {
  if (text.lines().empty()) throw Error("{}: holds no pose", file.string());
  return FormatOf(text.lines().front(), text.Where(text.lines().front()));
}

}  // namespace

bool HoldsKittiPoses(const std::filesystem::path& file) {
  return FormatOf(TextFile(file), file) == Format::kKitti;
}

Trajectory ReadTrajectory(const std::filesystem::path& file,
                          const std::filesystem::path& kitti_times) {
  const TextFile text(file);
  const Format format = FormatOf(text, file);
  if (!kitti_times.empty() && format != Format::kKitti) {
    throw Error("{}: has times of its own: expected KITTI poses to go with {}", file.string(),
                kitti_times.string());
  }
  Trajectory trajectory;
  trajectory.reserve(text.lines().size());
  Fields fields;
  for (const TextLine& line : text.lines()) {
    const std::string where = text.Where(line);
    const TimedPose pose = ParseLine(line, format, trajectory.size(), where, &fields);
    CheckOrder(trajectory, pose.time, where);
    trajectory.push_back(pose);
  }
  if (!kitti_times.empty()) SetTimes(kitti_times, file, &trajectory);
  return trajectory;
}

void WriteTrajectory(const std::filesystem::path& file, const Trajectory& trajectory) {
  AtomicFile output(file);
  output.Write("# seconds tx ty tz qx qy qz qw (camera to world)\n");
  fmt::memory_buffer line;
  for (const TimedPose& pose : trajectory) {
    const Eigen::Vector3d& p = pose.world_from_cam.translation();
    const Eigen::Quaterniond& q = pose.world_from_cam.rotation();
    if (!p.allFinite() || !q.coeffs().allFinite()) {
      throw Error("{}: the pose at {} ns is not finite", file.string(), pose.time.nanoseconds);
    }
    const int64_t ns = pose.time.nanoseconds;
    const uint64_t magnitude =
        ns < 0 ? uint64_t{0} - static_cast<uint64_t>(ns) : static_cast<uint64_t>(ns);
    line.clear();
    fmt::format_to(
        std::back_inserter(line), "{}{}.{:09} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
        ns < 0 ? "-" : "", magnitude / kNanosecondsPerSecond, magnitude % kNanosecondsPerSecond,
        p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
    output.Write({line.data(), line.size()});
  }
  output.Commit();
}

}  // namespace deepuav
