#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "deepuav/features/superpoint.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/system/frames/image_source.h"

namespace deepuav {

/// Which frames of a sequence are run, and with how much of what they show.
struct Part {
  int start = 0, end = 0, stride = 1, keypoints = 0;
  int drop_from = 0, drop_to = 0;    // left out: the camera jumps
  int blind_from = 0, blind_to = 0;  // without features: the camera sees nothing

  int repeat = 1;  // times that all of it is shown, one after the other

  int Frame(int index) const {
    const int frame = start + index % once() * stride;
    return frame < drop_from ? frame : frame + (drop_to - drop_from);
  }
  int once() const { return (end - start - (drop_to - drop_from) + stride - 1) / stride; }
  int size() const { return repeat * once(); }
  bool IsBlind(int frame) const { return frame >= blind_from && frame < blind_to; }
};

/// Takes a word "name=value" that names a field of Part; false for another.
bool SetPart(const std::string& word, Part* part);

/// The features of all frames, from `file`; extracted with `model` and kept there where it is not,
/// or is of another model, camera or sequence.
std::vector<Features> LoadOrExtract(Dataset* dataset, const std::string& file,
                                    const std::string& model);

/// Gives the frames' features in order of the calls.
class StoredExtractor : public Extractor {
 public:
  StoredExtractor(const std::vector<Features>* features, const SuperPointOptions& options,
                  const Part& part)
      : features_(features), options_(options), part_(part) {}

  Features Extract(const GreyImage& /*image*/, ExtractionTimes* /*times*/) override {
    const int frame = part_.Frame(next_++);
    const Features& all = features_->at(static_cast<size_t>(frame));
    if (part_.IsBlind(frame)) return Features{{}, Descriptors(all.descriptors.dimension())};
    const int count = CountOf(all);
    Features best{{all.keypoints.begin(), all.keypoints.begin() + count},
                  Descriptors(all.descriptors.dimension())};
    for (int i = 0; i < count; ++i) best.descriptors.AppendFrom(all.descriptors, i);
    return best;
  }
  std::string Description() const override { return "stored features"; }

 private:
  /// As many as the program would find with the options.
  int CountOf(const Features& all) const {
    const auto clear = std::count_if(
        all.keypoints.begin(), all.keypoints.end(),
        [&](const auto& k) { return static_cast<double>(k.score) > options_.threshold; });
    int count = std::min(all.size(), std::max(static_cast<int>(clear), options_.faint_keypoints));
    if (part_.keypoints > 0) count = std::min(count, part_.keypoints);
    return count;
  }

  const std::vector<Features>* features_;
  const SuperPointOptions options_;
  const Part part_;
  int next_ = 0;
};

/// The images themselves: patches are aligned on them. The dataset must outlive it.
class PartImages : public ImageSource {
 public:
  PartImages(Dataset* dataset, const Part& part) : dataset_(*dataset), part_(part) {}
  std::optional<TimedImage> Next() override {
    if (next_ == part_.size()) return std::nullopt;
    const int index = next_++;
    return TimedImage{FrameId{index}, TimeOf(index), dataset_.Load(part_.Frame(index))};
  }
  std::optional<Timestamp> UpcomingTime(int ahead) const override {
    if (next_ + ahead >= part_.size()) return std::nullopt;
    return TimeOf(next_ + ahead);
  }
  void Skip() override { ++next_; }

  /// Every repetition follows the one before at the distance of its first two frames.
  Timestamp TimeOf(int index) const {
    const auto time = [this](int i) { return dataset_.Time(part_.Frame(i)).nanoseconds; };
    const int last = part_.once() - 1;
    const int64_t period = time(last) - time(0) + (time(1) - time(0));
    return {time(index % part_.once()) + index / part_.once() * period};
  }

 private:
  Dataset& dataset_;
  const Part part_;
  int next_ = 0;
};

}  // namespace deepuav
