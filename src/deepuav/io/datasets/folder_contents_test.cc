#include "deepuav/io/datasets/folder_contents.h"

#include <gmock/gmock.h>

#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/geodata/gnss_file.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class FolderContentsTest : public testing::Test {
 protected:
  void WriteImage(const std::string& name) {
    folder_.Write(name, EncodedImage(64, 48, 1, std::filesystem::path(name).extension()));
  }
  std::string OpenError() {
    return ErrorOf([&] { OpenDataset(folder_.path()); });
  }

  TemporaryFolder folder_;
};

TEST_F(FolderContentsTest, AHeapOfDatasetsIsNoneOfPhotographs) {
  WriteImage("euroc/MH_10/mav0/cam0/data/1.png");
  WriteImage("euroc/MH_9/mav0/cam0/data/1.png");
  folder_.Write("tum/desk/rgb.txt", "");
  WriteImage("tum/desk/rgb/1.png");
  WriteImage("kitti/dataset/00/image_0/000000.png");
  folder_.Write("kitti/dataset/00/times.txt", "0\n");
  folder_.Write("asl/cam0/data.csv", "");
  EXPECT_THAT(SequencesBelow(folder_.path()),
              ElementsAre("asl", "euroc/MH_9", "euroc/MH_10", "kitti/dataset/00", "tum/desk"));
  EXPECT_EQ(OpenError(), folder_.path().string() +
                             ": holds datasets in sub-folders: expected one of them (asl, "
                             "euroc/MH_9, euroc/MH_10, kitti/dataset/00, tum/desk)");
  EXPECT_THAT(ErrorOf([&] { ReadPhotographFixes(folder_.path()); }), HasSubstr("sub-folders"));
}

TEST_F(FolderContentsTest, ManyDatasetsAreNotAllNamed) {
  WriteImage("a.jpg");
  for (int i = 1; i <= 12; ++i) folder_.Write(fmt::format("set{}/rgb.txt", i), "");
  EXPECT_THAT(OpenError(), EndsWith("(set1, set2, set3, set4, set5 and 7 more)"));
}

TEST_F(FolderContentsTest, PhotographsOfACardMayLieBesideVideos) {
  for (const char* name : {"DCIM/100MEDIA/a.jpg", "DCIM/101MEDIA/b.jpg", "cam0/c.jpg"})
    WriteImage(name);
  folder_.Write("DCIM/100MEDIA/a.mp4", "");
  folder_.Write("DCIM/.trash/rgb.txt", "");
  EXPECT_THAT(SequencesBelow(folder_.path() / "DCIM"), IsEmpty());
  EXPECT_EQ(OpenDataset(folder_.path() / "DCIM")->size(), 2);
}

TEST_F(FolderContentsTest, WhatIsDeepBelowOrInImagesIsNotLookedFor) {
  WriteImage("images/a.jpg");
  folder_.Write("before/mav0/cam0/data.csv", "");
  EXPECT_EQ(OpenDataset(folder_.path())->size(), 1);
  folder_.Write("1/2/3/4/rgb.txt", "");
  EXPECT_THAT(SequencesBelow(folder_.path()), ElementsAre("before"));
}

TEST_F(FolderContentsTest, ImagesThatCannotBeReadAreNamed) {
  for (const char* name : {"IMG_10.HEIC", "sub/IMG_9.heic", "b.gif", "c.jp2", "d.DNG", ".e.cr2"})
    folder_.Write(name, "x");
  EXPECT_EQ(OpenError(), folder_.path().string() +
                             ": holds images of formats that cannot be read, 1 .dng (d.DNG), 1 "
                             ".gif (b.gif), 2 .heic (IMG_9.heic, ...), 1 .jp2 (c.jp2): expected "
                             "them converted to JPEG");
  WriteImage("f.jpg");
  EXPECT_EQ(OpenDataset(folder_.path())->size(), 1);
}

TEST_F(FolderContentsTest, AFolderOfVideosNamesThem) {
  folder_.Write("b.MP4", "");
  folder_.Write("a.avi", "");
  EXPECT_THAT(OpenError(), AllOf(EndsWith(": is a folder of videos: expected one of them (a.avi, "
                                          "b.MP4)"),
                                 Not(HasSubstr("known layout"))));
}

}  // namespace
}  // namespace deepuav
