#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "deepuav/base/error.h"
#include "deepuav/evaluation/report/run_report.h"
#include "support/flights.h"

namespace deepuav {

/// A function that throws an Error whose text holds all of these.
template <typename... Parts>
auto Refuses(const Parts&... parts) {
  return testing::Throws<Error>(
      testing::Property(&Error::what, testing::AllOf(testing::HasSubstr(parts)...)));
}

/// The folder of a run with as little in it as may be: a summary and a trajectory of ten poses.
class RunFiles : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    root_ = std::filesystem::temp_directory_path() /
            fmt::format("deepuav_{}_{}", test->test_suite_name(), test->name());
    std::filesystem::remove_all(root_);
    run_ = root_ / "run";
    WriteLeast(run_);
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  static void WriteLeast(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    Write(folder / "summary.json", Summary(""));
    WriteTrajectory(folder / "trajectory.txt", MakeFlight(10, 10));
  }
  static void Write(const std::filesystem::path& file, std::string_view bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
  }
  /// A summary with more fields, as text: ", \"wall_s\": 3".
  static std::string Summary(const std::string& more) {
    return R"({"version": "1", "main_map": 0, "dataset": {"path": "/gone"})" + more + "}";
  }

  RunReport Report() const {
    RunReport report;
    report.run = ReadRunFolder(run_);
    return report;
  }

  std::filesystem::path root_, run_;
};

}  // namespace deepuav
