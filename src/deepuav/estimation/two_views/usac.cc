#include "deepuav/estimation/two_views/usac.h"

#include <limits>

namespace deepuav {

cv::UsacParams MakeUsacParams(double threshold, double confidence, int max_iterations,
                              uint64_t seed) {
  cv::UsacParams params;
  params.threshold = threshold;
  params.confidence = confidence;
  params.maxIterations = max_iterations;
  params.sampler = cv::SAMPLING_UNIFORM;
  params.score = cv::SCORE_METHOD_MSAC;
  params.loMethod = cv::LOCAL_OPTIM_INNER_LO;
  params.isParallel = false;
  params.randomGeneratorState =
      static_cast<int>((seed ^ (seed >> 32)) % std::numeric_limits<int>::max());
  return params;
}

}  // namespace deepuav
