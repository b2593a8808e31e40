#pragma once

#include <optional>
#include <vector>

#include "deepuav/features/superpoint.h"

namespace deepuav {

/// How many pixels of soft images count, as of a thermal camera, of an enlarged picture or out of
/// focus: those of the size at which the network finds most key points in the median of `images`,
/// halved and halved again. Nothing where that is their own size, or where key points are not
/// scarce there: in sharp images half the pixels hold 0.4 to 0.75 of them. All images
/// have the same size. Throws Error where there is no network.
std::optional<double> PixelsOfSoftImages(const std::vector<GreyImage>& images,
                                         const SuperPointOptions& options,
                                         const InferenceOptions& inference);

}  // namespace deepuav
