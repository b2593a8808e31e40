#pragma once

#include "deepuav/estimation/bundle/bundle_adjustment.h"

namespace deepuav {

enum class CeresSchur { kDense, kSparse };

struct CeresReport {
  int iterations = 0;
  double final_cost = 0;  ///< As of BundleReport: the sum of the Huber losses.
};

/// The same problem, loss and parameterisation as AdjustBundle, solved by Ceres on one thread;
/// always `iterations` steps unless it converges to the last bit.
CeresReport AdjustBundleByCeres(BundleProblem* problem, double chi_square, int iterations,
                                CeresSchur schur);

}  // namespace deepuav
