// How much of a map lies on things that move, by the truth of `deepuav simulate --moving-mask`:
//
//   moving_landmarks MAP.deepuav DATASET
//
// An observation is on a moving thing where a pixel beside its key point shows one, and on the edge
// of such a thing's shadow where pixels in the shadow and out of it lie beside it. A landmark is
// what most of its observations are. Prints shares and counts of landmarks and observations, and of
// all key points of the keyframes, which tell what the map chose from.

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <iostream>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "bench_main.h"
#include "deepuav/base/error.h"
#include "deepuav/io/maps/map_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

// As in the mask's sensor.yaml.
constexpr uint8_t kMoving = 255, kMovingShadow = 128;
constexpr int kBesidePx = 1;

enum Kind { kOnMoving, kOnShadowEdge, kOnStanding, kKinds };
constexpr std::array<const char*, kKinds> kKindNames = {"moving things", "edges of their shadows",
                                                        "standing things"};
using Counts = std::array<int64_t, kKinds>;

cv::Mat1b ReadMask(const fs::path& dataset, Timestamp time) {
  const fs::path file =
      dataset / "mav0" / "moving0" / "data" / (std::to_string(time.nanoseconds) + ".png");
  const cv::Mat1b mask = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  if (mask.empty())
    throw Error("{}: no mask there: expected one for every image, as of simulate --moving-mask",
                file.string());
  return mask;
}

Kind KindAt(const cv::Mat1b& mask, const Eigen::Vector2f& image_px) {
  const int x = static_cast<int>(std::lround(image_px.x()));
  const int y = static_cast<int>(std::lround(image_px.y()));
  const cv::Rect beside =
      cv::Rect(x - kBesidePx, y - kBesidePx, 2 * kBesidePx + 1, 2 * kBesidePx + 1) &
      cv::Rect({}, mask.size());
  const cv::Mat1b pixels = mask(beside);
  if (cv::countNonZero(pixels == kMoving) > 0) return kOnMoving;
  const int shaded = cv::countNonZero(pixels == kMovingShadow);
  return shaded > 0 && shaded < beside.area() ? kOnShadowEdge : kOnStanding;
}

int64_t Sum(const Counts& counts) { return counts[0] + counts[1] + counts[2]; }

Kind Most(const Counts& counts) {
  for (const Kind kind : {kOnMoving, kOnShadowEdge}) {
    if (2 * counts[kind] > Sum(counts)) return kind;
  }
  return kOnStanding;
}

class Tally {
 public:
  void Add(const Map& map, const fs::path& dataset) {
    std::map<KeyframeId, std::vector<Kind>> kinds;
    map.keyframes().ForEach([&](const Keyframe& keyframe) {
      const cv::Mat1b mask = ReadMask(dataset, keyframe.frame.time);
      pixels_[kOnMoving] += cv::countNonZero(mask == kMoving);
      pixels_[kOnShadowEdge] += cv::countNonZero(mask == kMovingShadow);
      pixels_[kOnStanding] += cv::countNonZero((mask != kMoving) & (mask != kMovingShadow));
      std::vector<Kind>& of_keypoints = kinds[keyframe.id];
      for (const Keypoint& keypoint : keyframe.features().keypoints) {
        of_keypoints.push_back(KindAt(mask, keypoint.image_px));
        ++keypoints_[of_keypoints.back()];
      }
    });
    map.landmarks().ForEach([&](const Landmark& landmark) {
      Counts of_landmark{};
      for (const Observation& seen : landmark.observations)
        ++of_landmark[kinds[seen.keyframe][static_cast<size_t>(seen.keypoint)]];
      const Kind kind = Most(of_landmark);
      ++landmarks_[kind];
      observations_[kind] += std::ssize(landmark.observations);
      for (int i = 0; i < kKinds; ++i) observed_[i] += of_landmark[i];
    });
  }

  void Print() const {
    std::cout << fmt::format("{:<26}{:>20}{:>24}{:>20}\n", "", kKindNames[kOnMoving],
                             kKindNames[kOnShadowEdge], kKindNames[kOnStanding]);
    Row("pixels (whole shadows)", pixels_);
    Row("key points", keypoints_);
    Row("landmarks", landmarks_);
    Row("observations of these", observations_);
    Row("observations by pixel", observed_);
  }

 private:
  static void Row(const char* name, const Counts& counts) {
    const auto cell = [&](Kind kind) {
      return fmt::format("{} = {:.2f} %", counts[kind],
                         100.0 * static_cast<double>(counts[kind]) /
                             static_cast<double>(std::max<int64_t>(Sum(counts), 1)));
    };
    std::cout << fmt::format("{:<26}{:>20}{:>24}{:>20}\n", name, cell(kOnMoving),
                             cell(kOnShadowEdge), cell(kOnStanding));
  }

  Counts pixels_{}, keypoints_{}, landmarks_{}, observations_{}, observed_{};
};

int Run(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: moving_landmarks MAP.deepuav DATASET\n";
    return 2;
  }
  const LoadedAtlas loaded = ReadMapFile(argv[1]);
  Tally tally;
  for (const MapId id : loaded.atlas.Remaining()) tally.Add(loaded.atlas.At(id), argv[2]);
  tally.Print();
  return 0;
}

}  // namespace
}  // namespace deepuav

int main(int argc, char** argv) {
  return deepuav::RunBench("moving_landmarks", [&] { return deepuav::Run(argc, argv); });
}
