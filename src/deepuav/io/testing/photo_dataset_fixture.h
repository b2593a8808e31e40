#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {

inline TestExif Drone() {
  TestExif exif;
  exif.model = "FC300S";
  exif.focal_length_mm = 3.61;
  exif.focal_length_35mm = 20;
  exif.latitude_deg = 28.5;
  exif.longitude_deg = -82.25;
  return exif;
}

class PhotoDatasetTest : public testing::Test {
 protected:
  void WritePhotograph(const std::string& name, const std::string& time, TestExif exif = Drone()) {
    exif.time = time;
    folder_.Write(name, JpegPhotograph(64, 48, 1, exif));
  }
  std::unique_ptr<Dataset> Open() { return OpenDataset(folder_.path()); }
  std::vector<std::string> Names() {
    std::vector<std::string> names;
    const auto dataset = Open();
    for (int i = 0; i < dataset->size(); ++i)
      names.push_back(std::filesystem::path(dataset->Name(i)).filename());
    return names;
  }
  using Strings = std::vector<std::string>;

  TemporaryFolder folder_;
};

}  // namespace deepuav
