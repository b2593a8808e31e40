#include "deepuav/io/datasets/photographs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/datasets/image_file_dataset.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

/// Many cameras write altitudes from another origin, or the barometer's.
constexpr double kAltitudeSigma_m = 10;

std::optional<GnssFix> FixOf(const PhotoExif& exif, std::string_view head) {
  std::optional<GnssFix> fix = ParseXmpRtkFix(head);
  if (!fix) {
    fix = exif.fix;
    if (!fix) return fix;
    const Eigen::Vector3d accuracy_m = ParseXmpAccuracy_m(head);
    if (accuracy_m.x() > 0) fix->sigma_m = accuracy_m;
  }
  if (fix->sigma_m.z() == 0) fix->sigma_m.z() = kAltitudeSigma_m;
  return fix;
}

/// What the file says of itself before its pixels.
void ReadHeader(Photograph* photograph) {
  // EXIF, XMP, thumbnail and what makers add.
  constexpr size_t kHeadBytes = size_t{512} << 10;
  try {
    const std::string head = ReadHead(photograph->file, kHeadBytes);
    photograph->exif = ParseExif({reinterpret_cast<const uint8_t*>(head.data()), head.size()});
    photograph->xmp = ParseXmpLens(head);
    photograph->fix = FixOf(photograph->exif, head);
    // Whether angles are of the picture as stored or as shown is not said.
    if (!photograph->exif.is_turned) photograph->enu_from_cam = ParseXmpAttitude(head);
    photograph->size = StoredSize(photograph->file);
  } catch (const Error& error) {  // Load() will say so again, when the frame's turn comes.
    Log().warn("{}", error.what());
  }
}

bool IsHidden(const fs::path& file, const fs::path& below) {
  const fs::path relative = file.lexically_relative(below);
  return std::any_of(relative.begin(), relative.end(),
                     [](const fs::path& part) { return part.string().starts_with('.'); });
}

/// Of one size and camera; photographs without EXIF are taken for those of the camera that most of
/// their size name.
using PhotographGroup = std::pair<std::pair<int, int>, std::string>;

std::vector<std::optional<PhotographGroup>> GroupsOf(const std::vector<Photograph>& photographs) {
  std::map<std::pair<int, int>, std::map<std::string, int>> models;
  const auto size_of = [](const Photograph& photograph) {
    return std::pair(photograph.size->width, photograph.size->height);
  };
  for (const Photograph& photograph : photographs) {
    if (photograph.size && !photograph.exif.camera_model.empty())
      ++models[size_of(photograph)][photograph.exif.camera_model];
  }
  std::vector<std::optional<PhotographGroup>> groups;
  for (const Photograph& photograph : photographs) {
    std::optional<PhotographGroup>& group = groups.emplace_back();
    if (!photograph.size) continue;
    std::string model = photograph.exif.camera_model;
    const std::map<std::string, int>& named = models[size_of(photograph)];
    if (model.empty() && !named.empty()) {
      model = std::max_element(named.begin(), named.end(), [](const auto& a, const auto& b) {
                return a.second < b.second;
              })->first;
    }
    group = {size_of(photograph), model};
  }
  return groups;
}

std::string Described(const PhotographGroup& group) {
  const auto& [size, model] = group;
  return fmt::format("{}x{}{}", size.first, size.second, model.empty() ? "" : " by " + model);
}

}  // namespace

std::vector<Photograph> ListPhotographs(const fs::path& images) {
  std::vector<Photograph> photographs;
  for (const auto& entry :
       fs::recursive_directory_iterator(images, fs::directory_options::skip_permission_denied)) {
    const fs::path& file = entry.path();
    if (IsImageFileName(file) && !IsHidden(file, images) && !entry.is_directory())
      photographs.push_back({file, {}, {}, {}, {}, {}});
  }
  std::sort(photographs.begin(), photographs.end(), [](const Photograph& a, const Photograph& b) {
    return ::strverscmp(a.file.c_str(), b.file.c_str()) < 0;
  });
  for (Photograph& photograph : photographs) ReadHeader(&photograph);
  return photographs;
}

void KeepLargestGroup(std::vector<Photograph>* photographs) {
  const std::vector<std::optional<PhotographGroup>> groups = GroupsOf(*photographs);
  std::map<PhotographGroup, std::vector<std::string>> names;
  for (size_t i = 0; i < groups.size(); ++i) {
    if (groups[i]) names[*groups[i]].push_back((*photographs)[i].file.filename().string());
  }
  if (names.size() < 2) return;
  const PhotographGroup largest =
      std::max_element(names.begin(), names.end(), [](const auto& a, const auto& b) {
        return a.second.size() < b.second.size();
      })->first;
  for (const auto& [group, files] : names) {
    if (group == largest) continue;
    Log().warn("left out, {} photographs that are {} where most are {}: {}", files.size(),
               Described(group), Described(largest), fmt::join(files, ", "));
  }
  std::vector<Photograph> kept;
  for (size_t i = 0; i < groups.size(); ++i) {
    if (!groups[i] || *groups[i] == largest) kept.push_back(std::move((*photographs)[i]));
  }
  *photographs = std::move(kept);
}

}  // namespace deepuav
