#include "deepuav/io/maps/point_cloud.h"

#include <cstring>
#include <fstream>
#include <limits>

#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

TEST(WritePly, HoldsEveryPoint) {
  const TemporaryFolder folder;
  const std::vector<ColouredPoint> points = {{{1.5, -2.25, 3}, {10, 20, 30}},
                                             ColouredPoint::Grey({4, 5, 6}, 200)};
  WritePly(folder.path() / "points.ply", points);
  const std::string bytes = ReadAll(folder.path() / "points.ply");
  const std::string end = "end_header\n";
  const size_t data = bytes.find(end) + end.size();
  const std::string header = bytes.substr(0, data);
  EXPECT_TRUE(header.starts_with("ply\nformat binary_little_endian 1.0\nelement vertex 2\n"))
      << header;
  ASSERT_EQ(bytes.size(), data + 2 * 15);
  for (size_t i = 0; i < 2; ++i) {
    float position[3];
    std::memcpy(position, bytes.data() + data + 15 * i, sizeof(position));
    for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(position[axis], points[i].position[axis]);
    EXPECT_EQ(std::memcmp(bytes.data() + data + 15 * i + 12, points[i].rgb.data(), 3), 0);
  }
}

TEST(WritePly, OfNoPointsIsAHeader) {
  const TemporaryFolder folder;
  WritePly(folder.path() / "points.ply", {});
  EXPECT_TRUE(ReadAll(folder.path() / "points.ply").ends_with("end_header\n"));
}

TEST(WritePly, ErrorsNameTheFile) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "points.ply";
  const std::vector<ColouredPoint> broken = {{{0, std::numeric_limits<double>::infinity(), 0}, {}}};
  EXPECT_EQ(ErrorOf([&] { WritePly(file, broken); }), file.string() + ": point 0 is not finite");
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_EQ(ErrorOf([] { WritePly("/nowhere/p.ply", {}); }),
            "/nowhere/p.ply: cannot be created: No such file or directory");
}

TEST(ReadPly, GivesBackWhatWasWritten) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "points.ply";
  const std::vector<ColouredPoint> points = {{{1.5, -2.25, 3}, {10, 20, 30}},
                                             ColouredPoint::Grey({4, 5, 6}, 200)};
  WritePly(file, points);
  const std::vector<ColouredPoint> read = ReadPly(file);
  ASSERT_EQ(read.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read[i].position, points[i].position);
    EXPECT_EQ(read[i].rgb, points[i].rgb);
  }
  WritePly(file, {});
  EXPECT_TRUE(ReadPly(file).empty());
}

TEST(ReadPly, OtherFilesAreErrorsThatNameThem) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "points.ply";
  WritePly(file, std::vector<ColouredPoint>{ColouredPoint::Grey({4, 5, 6}, 200)});
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 1);
  EXPECT_TRUE(ErrorOf([&] { ReadPly(file); }).starts_with(file.string() + ": "));
  std::ofstream(file) << "ply\nformat ascii 1.0\nend_header\n";
  EXPECT_TRUE(ErrorOf([&] { ReadPly(file); }).starts_with(file.string() + ": "));
}

}  // namespace
}  // namespace deepuav
