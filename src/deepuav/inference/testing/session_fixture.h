#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "deepuav/base/error.h"
#include "deepuav/inference/session.h"
#include "deepuav/inference/testing/small_networks.h"

namespace deepuav {

class SessionTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::path(testing::TempDir()) /
        (std::string("session_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    doubling_ = Write("doubling.xml", kDoubling);
    Write("doubling.bin", std::string(8, '\0'));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Write(const std::string& name, const std::string& content) {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return folder_ / name;
  }

  static InferenceOptions Fp32() {
    InferenceOptions options;
    options.precision = "fp32";
    return options;
  }

  /// One line that names the file and contains `expected`.
  template <typename Action>
  static void ExpectError(Action&& action, const std::string& file, const std::string& expected) {
    try {
      action();
      ADD_FAILURE() << "no error";
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_THAT(message, testing::HasSubstr(file));
      EXPECT_THAT(message, testing::HasSubstr(expected));
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
  }

  std::filesystem::path folder_, doubling_;
};

}  // namespace deepuav
