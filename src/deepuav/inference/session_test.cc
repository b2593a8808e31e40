#include "deepuav/inference/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/lsan_interface.h>
#endif

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/inference/testing/session_fixture.h"

namespace deepuav {
namespace {

using testing::ElementsAre;

TEST_F(SessionTest, RunsANetwork) {
  Session session(doubling_, Fp32());
  ASSERT_EQ(session.inputs().size(), 1u);
  EXPECT_EQ(session.inputs()[0].name, "x");
  EXPECT_EQ(session.inputs()[0].element_type, "f32");
  EXPECT_THAT(session.inputs()[0].shape, ElementsAre(1, 2, kAnySize, kAnySize));
  EXPECT_EQ(ShapeText(session.inputs()[0].shape), "[1,2,?,?]");
  session.Reshape({{"x", {1, 2, 1, 3}}});
  EXPECT_THAT(session.outputs()[0].shape, ElementsAre(1, 2, 1, 3));
  session.Compile();
  EXPECT_EQ(session.precision(), "fp32");
  EXPECT_FALSE(session.from_cache());

  std::vector<float> x{1, 2, 3, 4, 5, 6};
  session.SetInput("x", x);
  session.Run();
  EXPECT_THAT(session.Output("y"), ElementsAre(2, 4, 6, 8, 10, 12));
  EXPECT_THAT(session.OutputShape("y"), ElementsAre(1, 2, 1, 3));

  x[0] = 10;  // referred to, not copied
  session.Run();
  EXPECT_EQ(session.Output("y")[0], 20);
  const std::vector<float> other{7, 0, 0, 0, 0, 0};
  session.SetInput("x", other);
  session.Run();
  EXPECT_EQ(session.Output("y")[0], 14);
}

TEST_F(SessionTest, GivesChannelsLast) {
  Session session(doubling_, Fp32());
  session.Reshape({{"x", {1, 2, 1, 3}}});
  session.Compile({"y"});
  const std::vector<float> x{1, 2, 3, 4, 5, 6};
  session.SetInput("x", x);
  session.Run();
  EXPECT_THAT(session.Output("y"), ElementsAre(2, 8, 4, 10, 6, 12));
  EXPECT_THAT(session.OutputShape("y"), ElementsAre(1, 1, 3, 2));
  EXPECT_THAT(session.outputs()[0].shape, ElementsAre(1, 1, 3, 2));
}

TEST_F(SessionTest, FilesThatAreNoModelAreNamed) {
#ifdef __SANITIZE_ADDRESS__
  // OpenVINO leaks 8 bytes over such a file, in a library that it unloads, so that no suppression
  // can name it.
  const __lsan::ScopedDisabler leaks;
#endif
  ExpectError([&] { Session(folder_ / "none.onnx", Fp32()); }, "none.onnx", "no such file");
  ExpectError([&] { Session(folder_, Fp32()); }, folder_.string(), "no such file");
  for (const char* name : {"garbage.onnx", "garbage.xml"}) {
    Write("garbage.bin", "");
    const auto garbage = Write(name, "this is no network\n");
    ExpectError([&] { Session(garbage, Fp32()); }, name, "no network");
    const auto empty = Write(name, "");
    ExpectError([&] { Session(empty, Fp32()); }, name, "no network");
  }
  std::filesystem::remove(folder_ / "doubling.bin");
  ExpectError([&] { Session(doubling_, Fp32()); }, "doubling.xml", "its doubling.bin");
  ExpectError([&] { ModelSha256(doubling_); }, "doubling.xml", "its doubling.bin");
}

TEST_F(SessionTest, WrongShapesAreRefused) {
  Session session(doubling_, Fp32());
  ExpectError([&] { session.Compile(); }, "doubling.xml", "'x' has the open shape [1,2,?,?]");
  ExpectError(
      [&] {
        session.Reshape({{"x", {1, 3, 4, 4}}});
      },
      "doubling.xml", "'x' cannot have the shape [1,3,4,4]: expected [1,2,?,?]");
  ExpectError([&] { session.Reshape({{"x", {1, 2, 4}}}); }, "doubling.xml", "[1,2,4]");
  ExpectError([&] { session.Reshape({{"x", {1, 2, 4, kAnySize}}}); }, "doubling.xml", "[1,2,4,?]");
  ExpectError([&] { session.Reshape({}); }, "doubling.xml", "no shape for the input 'x'");
  ExpectError(
      [&] {
        session.Reshape({{"z", {1, 2, 4, 4}}});
      },
      "doubling.xml", "no tensor 'z': expected one of x");
}

TEST_F(SessionTest, WrongUseIsRefused) {
  Session session(doubling_, Fp32());
  const std::vector<float> x(6), short_x(5);
  ExpectError([&] { session.SetInput("x", x); }, "doubling.xml", "not compiled");
  ExpectError([&] { session.Run(); }, "doubling.xml", "not compiled");
  ExpectError([&] { session.Output("y"); }, "doubling.xml", "not compiled");
  ExpectError([&] { session.threads(); }, "doubling.xml", "not compiled");
  session.Reshape({{"x", {1, 2, 1, 3}}});
  ExpectError([&] { session.Compile({"z"}); }, "doubling.xml", "no tensor 'z'");
  session.Compile();
  ExpectError([&] { session.Run(); }, "doubling.xml", "'x' was never set");
  ExpectError([&] { session.SetInput("x", short_x); }, "doubling.xml",
              "given 5 values: expected 6");
  ExpectError([&] { session.Output("x"); }, "doubling.xml", "expected one of y");
  ExpectError([&] { session.Compile(); }, "doubling.xml", "compiled already");
}

TEST_F(SessionTest, OptionsAreChecked) {
  InferenceOptions options;
  EXPECT_NO_THROW(options.Check());
  options.threads = 0;
  EXPECT_THROW(options.Check(), Error);
  for (const char* precision : {"auto", "fp32", "bf16", "int8"}) {
    options = {};
    options.precision = precision;
    EXPECT_NO_THROW(options.Check()) << precision;
  }
  for (const char* precision : {"", "FP32", "int4"}) {
    options.precision = precision;
    EXPECT_THROW(options.Check(), Error) << precision;
  }
}

TEST_F(SessionTest, HashIsOfGraphAndWeights) {
  const std::string before = ModelSha256(doubling_);
  EXPECT_EQ(Session(doubling_, Fp32()).sha256(), before);
  Write("doubling.bin", std::string(8, '\1'));
  EXPECT_NE(ModelSha256(doubling_), before);
}

TEST_F(SessionTest, CacheGivesTheSameAndSurvivesDamage) {
  InferenceOptions options = Fp32();
  options.cache_dir = (folder_ / "cache").string();
  const std::vector<float> x{1, 2, 3, 4, 5, 6};
  const auto run = [&](int64_t width, bool expect_cached) {
    Session session(doubling_, options);
    session.Reshape({{"x", {1, 2, 1, width}}});
    session.Compile();
    EXPECT_EQ(session.from_cache(), expect_cached);
    session.SetInput("x", std::span(x).first(static_cast<size_t>(2 * width)));
    session.Run();
    EXPECT_EQ(session.Output("y")[1], 4);
  };
  run(3, false);
  run(3, true);
  run(2, false);  // another shape is another network
  for (const auto& entry : std::filesystem::directory_iterator(options.cache_dir)) {
    EXPECT_EQ(entry.path().extension(), ".blob");
    std::filesystem::resize_file(entry.path(), std::filesystem::file_size(entry.path()) / 2);
  }
  run(3, false);
  run(3, true);
}

}  // namespace
}  // namespace deepuav
