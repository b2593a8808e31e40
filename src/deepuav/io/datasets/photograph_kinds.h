#pragma once

#include <vector>

#include "deepuav/io/datasets/photographs.h"

namespace deepuav {

/// Leaves out the photographs that are not of the camera, band, zoom and size that most have, and
/// logs their names. Of several cameras that take about as many, as those on one drone do, one in
/// colour is kept rather than one of a band, then that with the widest view, then with most pixels.
/// Photographs without EXIF are taken for those of the camera that most of their size name.
void KeepOneKind(std::vector<Photograph>* photographs);

}  // namespace deepuav
