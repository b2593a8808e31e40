#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/matching/superglue.h"

namespace deepuav {
namespace {

TEST(SuperGlueOptionsTest, AreChecked) {
  SuperGlueOptions options;
  EXPECT_NO_THROW(options.Check());
  EXPECT_THROW(options.CheckModel(), Error);
  options.model = "superglue.onnx";
  EXPECT_NO_THROW(options.CheckModel());
  options.keypoints = 0;
  EXPECT_THROW(options.Check(), Error);
  options.keypoints = 1;
  for (const double score : {-0.1, 1.0, std::nan("")}) {
    options.min_score = score;
    EXPECT_THROW(options.Check(), Error) << score;
  }
  options.min_score = 0.2;
  options.precision = "fp8";
  EXPECT_THROW(options.Check(), Error);
  for (const char* precision : {"", "auto", "bf16"}) {
    options.precision = precision;
    EXPECT_NO_THROW(options.Check()) << precision;
  }
}

TEST(SuperGlueOptionsTest, ItsPrecisionIsItsOwnAndNothingIsCached) {
  InferenceOptions general;
  general.threads = 3;
  general.precision = "int8";
  general.cache_dir = "folder";
  SuperGlueOptions options;
  options.precision = "fp32";
  EXPECT_EQ(options.Inference(general).precision, "fp32");
  EXPECT_EQ(options.Inference(general).threads, 3);
  EXPECT_EQ(options.Inference(general).cache_dir, "");
  options.precision = "";
  EXPECT_EQ(options.Inference(general).precision, "int8");
}

}  // namespace
}  // namespace deepuav
