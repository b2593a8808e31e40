#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/features/image_region.h"
#include "deepuav/features/keypoint_grid.h"

namespace deepuav {

/// What tells that something moves along with the camera.
struct ImageFixedOptions {
  bool set_aside = true;
  double max_shift_px = 1;          ///< Of a key point that stays where it is in the image.
  double min_similarity = 0.6;      ///< Of its descriptors.
  double min_contradiction_px = 4;  ///< From where anything that stands could be seen.
  int interval_frames = 3;          ///< Between the views compared.
  int kept_views = 16;              ///< Earlier ones that each is compared with.
  int min_votes = 4;                ///< Views in which a cell of the image shows such a thing...
  double min_share = 0.5;           ///< ...of those that could tell.
  int remembered_votes = 64;        ///< Of a cell; older ones count half, and so on.
  double max_image_share = 0.4;     ///< Of the key points that can tell; more: the pose is wrong.
  int cell_px = 8;
  double begin_anew_share = 0.05;  ///< Of the key points, offline.
  int compared_photographs = 12;   ///< Others that each of a survey is compared with.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("set_aside", set_aside, "",
          "leave out key points where something fixed to the camera shows, as writing, its own "
          "vehicle or dirt");
    visit("max_shift_px", max_shift_px, "px", "by which such a key point moves in the image",
          Between(0, 100));
    visit("min_similarity", min_similarity, "", "of its descriptors in two views", Between(-1, 1));
    visit("min_contradiction_px", min_contradiction_px, "px",
          "distance from where any point that stands would be seen", Above(0, 1000));
    visit("interval_frames", interval_frames, "", "frames between the views compared",
          Between(1, 10'000));
    visit("kept_views", kept_views, "", "earlier views that each is compared with",
          Between(1, 1000));
    visit("min_votes", min_votes, "", "views in which a cell of the image must show such a thing",
          Between(1, 1000));
    visit("min_share", min_share, "", "share of the views that could tell which must say so",
          Above(0, 1));
    visit("remembered_votes", remembered_votes, "", "votes of a cell beyond which old ones fade",
          Between(2, 1'000'000));
    visit("max_image_share", max_image_share, "",
          "share of key points that stay in place above which the pose is doubted instead",
          Above(0, 1));
    visit("cell_px", cell_px, "px", "size of a cell", Between(1, 1000));
    visit("begin_anew_share", begin_anew_share, "",
          "share of the key points left out from which a run offline is begun anew with what it "
          "has learnt",
          Between(0, 1));
    visit("compared_photographs", compared_photographs, "",
          "others that each photograph of a survey is compared with", Between(1, 1000));
  }
};

/// Key points by where the image as taken has them. Const use is thread-safe.
class KeypointPlaces {
 public:
  explicit KeypointPlaces(std::shared_ptr<const Features> features);
  KeypointPlaces(const KeypointPlaces&) = delete;
  KeypointPlaces& operator=(const KeypointPlaces&) = delete;

  /// Whether a key point of `features` is here, too, at its place and alike.
  bool HasThere(const Features& features, int keypoint, const ImageFixedOptions& options) const;
  const Features& features() const { return *features_; }

 private:
  std::shared_ptr<const Features> features_;
  Features places_;  ///< Key points alone, `px` being `image_px`.
  KeypointGrid grid_;
};

/// Where an image shows what is fixed to the camera, by majority of what views tell. Value type.
class ImageFixedVotes {
 public:
  ImageFixedVotes(int width_px, int height_px, const ImageFixedOptions& options);

  /// `telling`: the cells of a view's key points that could tell; `fixed`: of those that are fixed,
  /// so many of which that the view is doubted instead count nothing.
  void Count(const std::vector<int>& telling, const std::vector<int>& fixed);
  /// What the votes say: the cells, and those that touch them.
  ImageRegion Region() const;
  /// Nothing, of this image.
  const ImageRegion& blank() const { return blank_; }

 private:
  struct Votes {
    float fixed = 0, all = 0;
  };
  ImageFixedOptions options_;
  ImageRegion blank_;
  std::vector<Votes> votes_;  ///< One a cell.
};

/// Of photographs from places of their own, of one camera: where they show the same at the same
/// pixel. In any order.
ImageRegion FixedInPhotographs(const std::vector<std::shared_ptr<const Features>>& photographs,
                               int width_px, int height_px, const ImageFixedOptions& options);

}  // namespace deepuav
