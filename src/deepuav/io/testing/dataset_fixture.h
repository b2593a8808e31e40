#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {

inline std::string ToString(std::string_view text) { return std::string(text); }

class DatasetTest : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::unique_ptr<Dataset> Open(const DatasetOptions& options = {}) {
    return OpenDataset(folder_.path(), options);
  }
  std::string OpenError() {
    return ErrorOf([&] { Open(); });
  }
  void WriteFrames(const std::string& prefix, const std::vector<std::string>& names) {
    for (size_t i = 0; i < names.size(); ++i) {
      folder_.Write(prefix + names[i], EncodedImage(64, 48, static_cast<int>(i),
                                                    std::filesystem::path(names[i]).extension()));
    }
  }

  TemporaryFolder folder_;
};

}  // namespace deepuav
