#include "deepuav/io/maps/colmap_model.h"

#include <fmt/format.h>
#include <set>
#include <string>

#include <iterator>

#include "deepuav/base/error.h"
#include "deepuav/io/files/atomic_file.h"

namespace deepuav {
namespace {

constexpr int kCameraId = 1;
constexpr double kPixelShift = 0.5;
constexpr double kNoError = -1;  // COLMAP's own for an error not known
constexpr size_t kBrownOfThreeRadii = 5;

using ImageNames = std::map<KeyframeId, std::string>;

/// Collects lines and hands them to the file one by one.
class LineFile {
 public:
  explicit LineFile(const std::filesystem::path& file) : file_(file) {}

  template <typename... Args>
  void Add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(line_), format, std::forward<Args>(args)...);
  }
  void EndLine() {
    line_.push_back('\n');
    file_.Write({line_.data(), line_.size()});
    line_.clear();
  }
  void Commit() { file_.Commit(); }

 private:
  AtomicFile file_;
  fmt::memory_buffer line_;
};

int64_t ImageId(KeyframeId id) { return id.value + 1; }
int64_t PointId(LandmarkId id) { return id.value + 1; }

std::string ColmapName(const Keyframe& keyframe, const ImageNames& names) {
  const auto found = names.find(keyframe.id);
  std::string name = found != names.end() && !found->second.empty()
                         ? found->second
                         : fmt::format("{}", keyframe.frame.time.nanoseconds);
  for (char& character : name) {
    const auto code = static_cast<unsigned char>(character);
    if (code <= ' ' || code == 0x7f) character = '_';
  }
  return name;
}

/// COLMAP's model of the same lens, and its parameters in COLMAP's order.
struct ColmapCamera {
  const char* model = "PINHOLE";
  std::vector<double> parameters;
};

ColmapCamera ColmapCameraOf(const Camera& camera) {
  const Pinhole& pinhole = camera.pinhole;
  ColmapCamera colmap;
  colmap.parameters = {pinhole.fx, pinhole.fy, pinhole.cx + kPixelShift, pinhole.cy + kPixelShift};
  colmap.parameters.insert(colmap.parameters.end(), camera.distortion.begin(),
                           camera.distortion.end());
  if (camera.lens == LensModel::kEquidistant) {
    colmap.model = "OPENCV_FISHEYE";
  } else if (camera.lens == LensModel::kRadialTangential) {
    const bool has_k3 = camera.distortion.size() == kBrownOfThreeRadii;
    colmap.model = has_k3 ? "FULL_OPENCV" : "OPENCV";
    if (has_k3) colmap.parameters.insert(colmap.parameters.end(), {0, 0, 0});  // k4 to k6
  }
  return colmap;
}

void WriteCameras(const std::filesystem::path& file, const Camera& camera) {
  LineFile lines(file);
  const ColmapCamera colmap = ColmapCameraOf(camera);
  lines.Add("# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]");
  lines.EndLine();
  lines.Add("{} {} {} {}", kCameraId, colmap.model, camera.width, camera.height);
  for (const double parameter : colmap.parameters) lines.Add(" {}", parameter);
  lines.EndLine();
  lines.Commit();
}

void WriteImages(const std::filesystem::path& file, const Map& map, const ImageNames& names) {
  LineFile lines(file);
  lines.Add(
      "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then X Y POINT3D_ID of each key point");
  lines.EndLine();
  std::set<std::string> taken;
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    // Flights that were joined may have files of the same name.
    std::string name = ColmapName(keyframe, names);
    if (!taken.insert(name).second) name = fmt::format("{}_{}", ImageId(keyframe.id), name);
    taken.insert(name);
    const Eigen::Quaterniond& q = keyframe.cam_from_world.rotation();
    const Eigen::Vector3d& t = keyframe.cam_from_world.translation();
    lines.Add("{} {} {} {} {} {} {} {} {} {}", ImageId(keyframe.id), q.w(), q.x(), q.y(), q.z(),
              t.x(), t.y(), t.z(), kCameraId, name);
    lines.EndLine();
    const char* separator = "";
    for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      const Eigen::Vector2d px = keyframe.features().keypoints[i].image_px.cast<double>();
      const LandmarkId landmark = keyframe.landmarks[i];
      lines.Add("{}{} {} {}", separator, px.x() + kPixelShift, px.y() + kPixelShift,
                landmark.valid() ? PointId(landmark) : -1);
      separator = " ";
    }
    lines.EndLine();
  });
  lines.Commit();
}

/// Mean distance in the images as taken of what is seen from where the landmark projects to.
double ReprojectionErrorPx(const Landmark& landmark, const Map& map, const Camera& camera) {
  double sum = 0;
  int count = 0;
  for (const Observation& observation : landmark.observations) {
    const Keyframe& keyframe = map.At(observation.keyframe);
    const auto px = camera.Distort(keyframe.cam_from_world * landmark.position_world);
    if (!px) continue;
    const auto keypoint = static_cast<size_t>(observation.keypoint);
    sum += (*px - keyframe.features().keypoints[keypoint].image_px.cast<double>()).norm();
    ++count;
  }
  return count > 0 ? sum / count : kNoError;
}

void WritePoints(const std::filesystem::path& file, const Map& map, const Camera& camera) {
  constexpr int kGrey = 180;
  LineFile lines(file);
  lines.Add("# POINT3D_ID X Y Z R G B ERROR, then IMAGE_ID POINT2D_IDX of each observation");
  lines.EndLine();
  map.landmarks().ForEach([&](const Landmark& landmark) {
    const Eigen::Vector3d& p = landmark.position_world;
    lines.Add("{} {} {} {} {} {} {} {}", PointId(landmark.id), p.x(), p.y(), p.z(), kGrey, kGrey,
              kGrey, ReprojectionErrorPx(landmark, map, camera));
    for (const Observation& observation : landmark.observations)
      lines.Add(" {} {}", ImageId(observation.keyframe), observation.keypoint);
    lines.EndLine();
  });
  lines.Commit();
}

}  // namespace

void WriteColmapModel(const std::filesystem::path& folder, const Map& map, const Camera& camera,
                      const ImageNames& image_names) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Error("{}: cannot be made: {}", folder.string(), error.message());
  WriteCameras(folder / "cameras.txt", camera);
  WriteImages(folder / "images.txt", map, image_names);
  WritePoints(folder / "points3D.txt", map, camera);
}

}  // namespace deepuav
