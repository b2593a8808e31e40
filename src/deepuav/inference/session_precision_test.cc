#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "deepuav/base/random.h"
#include "deepuav/inference/cpu_arithmetic.h"
#include "deepuav/inference/session.h"
#include "deepuav/inference/testing/session_fixture.h"
#include "deepuav/inference/testing/small_networks.h"

namespace deepuav {
namespace {

std::vector<float> Noise(size_t size, uint64_t seed) {
  Random random(seed);
  std::vector<float> noise(size);
  for (float& value : noise) value = static_cast<float>(random.Uniform(0, 1));
  return noise;
}

TEST_F(SessionTest, AutomaticPrecisionIsResolved) {
  const Session session(doubling_, {});
  EXPECT_THAT(session.precision(), testing::AnyOf("fp32", "bf16"));
}

TEST_F(SessionTest, ArithmeticOfTheCpu) {
  EXPECT_TRUE(HasFastArithmetic("fp32"));
  EXPECT_FALSE(HasFastArithmetic("fp12"));
  const Session session(doubling_, {});
  EXPECT_EQ(session.precision(), HasFastArithmetic("bf16") ? "bf16" : "fp32");
  EXPECT_FALSE(CpuName().empty());
}

TEST_F(SessionTest, QuantisedNetworks) {
  const auto quantised = Write("quantised.xml", kQuantised);
  const float range[] = {0, 25.5f};
  Write("quantised.bin", std::string(reinterpret_cast<const char*>(range), sizeof(range)));
  InferenceOptions options = Fp32();
  EXPECT_EQ(Session(quantised, options).precision(), "int8+fp32");
  options.precision = "bf16";
  EXPECT_EQ(Session(quantised, options).precision(), "int8+bf16");
  EXPECT_EQ(Session(quantised, {}).precision(), "int8+fp32");
  options.precision = "int8";
  Session session(quantised, options);
  EXPECT_EQ(session.precision(), "int8+fp32");
  session.Reshape({{"x", {1, 2, 1, 2}}});
  session.Compile();
  const std::vector<float> x{-3, 1.04f, 7.26f, 90};
  session.SetInput("x", x);
  session.Run();
  const std::vector<float> expected{0, 1, 7.3f, 25.5f};
  for (size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(session.Output("y")[i], expected[i], 1e-4f);
  ExpectError([&] { Session(doubling_, options); }, "doubling.xml", "is not quantised");
}

/// OpenVINO 2026.4 gives other numbers for this network on a CPU with AMX.
TEST_F(SessionTest, Bf16GivesWhatTheNetworkSays) {
  const auto folding = Write("folding.xml", kFolding);
  const auto weights = Noise(kFoldedFilters * kFoldedChannels * kFold * kFold, 1);
  Write("folding.bin",
        std::string(reinterpret_cast<const char*>(weights.data()), weights.size() * sizeof(float)));
  const auto x = Noise(kFoldedChannels * kFoldedSide * kFoldedSide, 2);
  InferenceOptions options;
  options.precision = "bf16";
  options.cache_dir = (folder_ / "cache").string();
  for (int instance = 0; instance < 2; ++instance) {
    Session session(folding, options);
    session.Reshape({{"x", {1, kFoldedChannels, kFoldedSide, kFoldedSide}}});
    session.Compile();
    session.SetInput("x", x);
    session.Run();
    for (int filter = 0; filter < kFoldedFilters; ++filter) {
      float expected = 0;  // of the block at the third row, second column
      for (int channel = 0; channel < kFoldedChannels; ++channel) {
        for (int row = 0; row < kFold; ++row) {
          for (int column = 0; column < kFold; ++column) {
            const int weight =
                ((filter * kFoldedChannels + channel) * kFold + row) * kFold + column;
            const int pixel =
                (channel * kFoldedSide + 2 * kFold + row) * kFoldedSide + kFold + column;
            expected += weights[weight] * x[pixel];
          }
        }
      }
      constexpr int kBlocks = kFoldedSide / kFold;
      const float found = session.Output("y")[(filter * kBlocks + 2) * kBlocks + 1];
      EXPECT_NEAR(found, expected, 0.02f * expected) << filter;
    }
  }
}

/// On a real network the runtime splits the work between threads, which must not show in the
/// result.
TEST_F(SessionTest, RealNetworkIsDeterministic) {
  const char* shared = std::getenv("DEEPUAV_SHARED");
  if (!shared) GTEST_SKIP() << "DEEPUAV_SHARED is not set";
  const auto model = std::filesystem::path(shared) / "models" / "superpoint_coco.onnx";
  const auto image = Noise(240 * 320, 1);
  for (const char* precision : {"fp32", "bf16"}) {
    InferenceOptions options;
    options.precision = precision;
    options.cache_dir = (folder_ / "cache").string();
    std::vector<float> first;
    for (int instance = 0; instance < 3; ++instance) {  // the later two from the cache
      Session session(model, options);
      session.Reshape({{"image", {1, 1, 240, 320}}});
      session.Compile({"descriptors"});
      EXPECT_EQ(session.threads(),
                std::min<int>(options.threads, std::thread::hardware_concurrency()));
      EXPECT_EQ(session.from_cache(), instance > 0);
      session.SetInput("image", image);
      for (int run = 0; run < 2; ++run) {
        session.Run();
        std::vector<float> found(session.Output("logits").begin(), session.Output("logits").end());
        const auto descriptors = session.Output("descriptors");
        found.insert(found.end(), descriptors.begin(), descriptors.end());
        if (first.empty()) first = found;
        ASSERT_EQ(found.size(), first.size());
        EXPECT_EQ(std::memcmp(found.data(), first.data(), found.size() * sizeof(float)), 0)
            << precision;
      }
    }
  }
}

}  // namespace
}  // namespace deepuav
