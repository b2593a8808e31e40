#include "deepuav/io/datasets/dataset.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "deepuav/io/testing/dataset_fixture.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

TEST_F(DatasetTest, AnUnknownLayoutListsTheKnownOnes) {
  folder_.Write("notes.txt", "hello");
  const std::string message = OpenError();
  EXPECT_TRUE(message.starts_with(folder_.path().string() + ": no known layout")) << message;
  for (const char* layout : {"mav0/", "rgb.txt", "image_0/", "times.txt", "calib.txt", "jpg"}) {
    EXPECT_NE(message.find(layout), std::string::npos) << layout;
  }
}

TEST_F(DatasetTest, WhatIsNoDatasetIsNamed) {
  EXPECT_EQ(OpenError(), folder_.path().string() + ": the folder is empty: expected a dataset");
  EXPECT_EQ(ErrorOf([] { OpenDataset("/nowhere/set"); }),
            "/nowhere/set: there is no such file or folder: expected a dataset");
  const std::string text = folder_.Write("a.txt", "x").string();
  EXPECT_TRUE(
      ErrorOf([&] { OpenDataset(text); }).starts_with(text + ": is no folder and no known video"));
}

TEST(RealDatasets, Open) {
  const auto shared = SharedFolder();
  if (!shared) GTEST_SKIP() << "no real sequences: set DEEPUAV_SHARED to their folder";
  const auto euroc = OpenDataset(*shared / "data/euroc_mh01_excerpt");
  EXPECT_EQ(euroc->Kind(), "euroc");
  EXPECT_EQ(euroc->size(), 340);
  EXPECT_EQ(euroc->camera().pinhole.fx, 458.654);
  EXPECT_EQ(euroc->camera().pinhole.cy, 248.375);
  EXPECT_EQ(euroc->camera().distortion,
            (std::vector<double>{-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}));
  EXPECT_EQ(euroc->Load(339).size(), cv::Size(752, 480));

  const auto scenes = OpenDataset(*shared / "data/7scenes_redkitchen");
  EXPECT_EQ(scenes->Kind(), "tum");
  EXPECT_EQ(scenes->size(), 1000);
  EXPECT_EQ(scenes->camera().pinhole.fx, 585);
  EXPECT_EQ(scenes->Load(999).size(), cv::Size(640, 480));

  const auto survey = OpenDataset(*shared / "data/uav_nadir_survey");
  EXPECT_EQ(survey->Kind(), "photographs");
  EXPECT_EQ(survey->size(), 172);
  EXPECT_TRUE(survey->CalibrationIsApproximate());
  EXPECT_NEAR(survey->camera().pinhole.fx, 462.25, 0.01);
  const std::vector<GnssFix> fixes = survey->ReadSensors().gnss.fixes;
  ASSERT_EQ(fixes.size(), 172u);
  EXPECT_NEAR(fixes[0].latitude_deg, 28 + 2 / 60.0 + 28.5116 / 3600, 1e-9);
  EXPECT_NEAR(fixes[0].longitude_deg, -(82 + 41 / 60.0 + 54.5072 / 3600), 1e-9);
  EXPECT_EQ(survey->Load(171).size(), cv::Size(800, 600));
  for (int i = 1; i < survey->size(); ++i) {
    EXPECT_GT(survey->Time(i), survey->Time(i - 1));
    EXPECT_GT(survey->Name(i), survey->Name(i - 1));
    EXPECT_EQ(fixes[static_cast<size_t>(i)].time, survey->Time(i));
  }
}

}  // namespace
}  // namespace deepuav
