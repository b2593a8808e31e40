#include "deepuav/io/datasets/photograph_kinds.h"

#include "deepuav/io/testing/photo_dataset_fixture.h"

namespace deepuav {
namespace {

Photograph Taken(const std::string& name, cv::Size size, const std::string& model, double focal_mm,
                 double focal_35mm, const std::string& band = "") {
  Photograph photograph;
  photograph.file = name;
  photograph.size = size;
  photograph.exif.camera_model = model;
  if (focal_mm > 0) photograph.exif.focal_length_mm = focal_mm;
  if (focal_35mm > 0) photograph.exif.focal_length_35mm = focal_35mm;
  photograph.band = band;
  return photograph;
}

std::string NamesKept(std::vector<Photograph> photographs) {
  KeepOneKind(&photographs);
  std::string names;
  for (const Photograph& photograph : photographs) names += photograph.file.string() + " ";
  return names;
}

const cv::Size kFull(4000, 3000), kThermal(640, 512);

TEST(KeepOneKind, OfTheCamerasOnOneDroneTheWideOneIsTaken) {
  EXPECT_EQ(NamesKept({Taken("1_T", kThermal, "M3T", 9.1, 40), Taken("1_W", kFull, "M3T", 4.4, 24),
                       Taken("1_Z", kFull, "M3T", 30, 162), Taken("2_T", kThermal, "M3T", 9.1, 40),
                       Taken("2_W", kFull, "M3T", 4.4, 24), Taken("2_Z", kFull, "M3T", 30, 162)}),
            "1_W 2_W ");
}

TEST(KeepOneKind, TheWideOneMayHaveLostWhatItsFirstPhotographSaid) {
  EXPECT_EQ(
      NamesKept({Taken("1_W", kFull, "", 0, 0), Taken("1_T", kThermal, "M3T", 9.1, 40),
                 Taken("2_W", kFull, "M3T", 4.4, 24), Taken("2_T", kThermal, "M3T", 9.1, 40)}),
      "1_W 2_W ");
  // Nothing tells which view is the wider one.
  EXPECT_EQ(NamesKept({Taken("1_W", kFull, "X", 0, 0), Taken("1_T", kThermal, "X", 9.1, 40)}),
            "1_W ");
}

TEST(KeepOneKind, ColourComesBeforeBandsAndGreenBeforeOtherBands) {
  std::vector<Photograph> bands, all;
  for (const char* name : {"1", "2"}) {
    all.push_back(Taken(std::string(name) + ".jpg", kFull, "FC6360", 5.74, 40));
    for (const char* band : {"Blue", "Green", "NIR", "Red"})
      bands.push_back(Taken(std::string(name) + band, kFull, "FC6360", 5.74, 40, band));
  }
  EXPECT_EQ(NamesKept(bands), "1Green 2Green ");
  all.insert(all.end(), bands.begin(), bands.end());
  EXPECT_EQ(NamesKept(all), "1.jpg 2.jpg ");
}

TEST(KeepOneKind, ALensIsNotTakenForTheSameZoomedIn) {
  EXPECT_EQ(NamesKept({Taken("a", kFull, "Z", 4.3, 24), Taken("b", kFull, "Z", 8.6, 48),
                       Taken("c", kFull, "Z", 4.3, 24), Taken("d", kFull, "Z", 0, 0),
                       Taken("e", kFull, "Z", 4.5, 25)}),
            "a c d e ");
}

TEST(KeepOneKind, FarMoreOfOneKindAreTakenWhateverItIs) {
  std::vector<Photograph> photographs = {Taken("wide", kFull, "M3T", 4.4, 24)};
  for (const char* name : {"a", "b", "c"})
    photographs.push_back(Taken(name, kThermal, "M3T", 9.1, 40));
  EXPECT_EQ(NamesKept(photographs), "a b c ");
}

TEST(KeepOneKind, WithoutACamerasNameTheyAreOfTheOneThatOthersName) {
  EXPECT_EQ(NamesKept({Taken("a", kFull, "", 0, 0), Taken("b", kFull, "X", 4.4, 24),
                       Taken("c", kThermal, "", 0, 0)}),
            "a b ");
  Photograph unreadable;
  unreadable.file = "u";
  EXPECT_EQ(NamesKept({unreadable, Taken("a", kFull, "", 0, 0)}), "u a ");
}

}  // namespace
}  // namespace deepuav
