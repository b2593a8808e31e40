#include "deepuav/inference/precision_check.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <openvino/opsets/opset13.hpp>

#include "deepuav/inference/network_file.h"

namespace deepuav {
namespace {

/// Gives its input, and its input times a factor.
ov::CompiledModel Scaling(float factor) {
  const auto x = std::make_shared<ov::opset13::Parameter>(ov::element::f32, ov::Shape{1, 2, 8});
  const auto by = ov::opset13::Constant::create(ov::element::f32, ov::Shape{}, {factor});
  const auto same = std::make_shared<ov::opset13::Relu>(x);
  const auto scaled = std::make_shared<ov::opset13::Multiply>(x, by);
  const auto model =
      std::make_shared<ov::Model>(ov::OutputVector{same, scaled}, ov::ParameterVector{x});
  return Core().compile_model(model, "CPU", ov::hint::inference_precision(ov::element::f32));
}

TEST(PrecisionCheckTest, GivesTheOutputThatDiffersMost) {
  auto reference = Scaling(2);
  for (const float factor : {2.0f, 2.2f, 1.0f, -2.0f, 0.0f}) {
    auto other = Scaling(factor);
    EXPECT_NEAR(RelativeDifference(reference, other), std::abs(factor / 2 - 1), 1e-6) << factor;
  }
}

TEST(PrecisionCheckTest, WhatIsNoNumberDiffersEndlessly) {
  auto none = Scaling(0), reference = Scaling(2);
  EXPECT_EQ(RelativeDifference(none, reference), std::numeric_limits<double>::infinity());
  auto broken = Scaling(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(RelativeDifference(reference, broken), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace deepuav
