#include "deepuav/io/maps/las_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

constexpr size_t kHeaderBytes = 227, kRecordBytes = 26;

/// Reads by the offsets of the specification's tables.
class LasBytes {
 public:
  explicit LasBytes(std::string bytes) : bytes_(std::move(bytes)) {}

  template <typename T>
  T At(size_t offset) const {
    T value{};
    EXPECT_LE(offset + sizeof(T), bytes_.size());
    if (offset + sizeof(T) <= bytes_.size()) std::memcpy(&value, bytes_.data() + offset, sizeof(T));
    return value;
  }
  Eigen::Vector3d Scale() const { return Vector(131, 8); }
  Eigen::Vector3d Offset() const { return Vector(155, 8); }
  Eigen::Vector3d Max() const { return Vector(179, 16); }
  Eigen::Vector3d Min() const { return Vector(187, 16); }
  Eigen::Vector3d Position(size_t point) const {
    const size_t at = kHeaderBytes + kRecordBytes * point;
    const Eigen::Vector3d steps(At<int32_t>(at), At<int32_t>(at + 4), At<int32_t>(at + 8));
    return Offset() + Scale().cwiseProduct(steps);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  Eigen::Vector3d Vector(size_t at, size_t step) const {
    return {At<double>(at), At<double>(at + step), At<double>(at + 2 * step)};
  }

  std::string bytes_;
};

class WriteLasTest : public ::testing::Test {
 protected:
  LasBytes Written(const std::vector<ColouredPoint>& points) {
    WriteLas(file_, points);
    return LasBytes(ReadAll(file_));
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "points.las";
};

TEST_F(WriteLasTest, HoldsEveryPoint) {
  const std::vector<ColouredPoint> points = {
      {{1.5, -2.25, 3}, {10, 20, 255}}, {{-7.1234567, 12, 0.1}, {}}, {{2, 3, 1000}, {1, 2, 3}}};
  const LasBytes las = Written(points);
  ASSERT_EQ(las.bytes().size(), kHeaderBytes + points.size() * kRecordBytes);
  EXPECT_EQ(las.bytes().substr(0, 4), "LASF");
  EXPECT_EQ(las.At<uint8_t>(24), 1);
  EXPECT_EQ(las.At<uint8_t>(25), 2);
  EXPECT_EQ(las.At<uint16_t>(94), kHeaderBytes);
  EXPECT_EQ(las.At<uint32_t>(96), kHeaderBytes);
  EXPECT_EQ(las.At<uint8_t>(104), 2);
  EXPECT_EQ(las.At<uint16_t>(105), kRecordBytes);
  EXPECT_EQ(las.At<uint32_t>(107), points.size());
  EXPECT_EQ(las.At<uint32_t>(111), points.size());
  EXPECT_EQ(las.At<uint32_t>(115), 0u);
  EXPECT_EQ(las.Scale(), Eigen::Vector3d::Constant(1e-6));
  for (size_t i = 0; i < points.size(); ++i) {
    EXPECT_LE((las.Position(i) - points[i].position).cwiseAbs().maxCoeff(), 0.51e-6);
    const size_t at = kHeaderBytes + kRecordBytes * i;
    EXPECT_EQ(las.At<uint8_t>(at + 14), 9);
    for (size_t c = 0; c < 3; ++c)
      EXPECT_EQ(las.At<uint16_t>(at + 20 + 2 * c), 257 * points[i].rgb[c]);
  }
}

TEST_F(WriteLasTest, TheHeaderHoldsTheExtentAsWritten) {
  const LasBytes las = Written({{{1, 7, -3}, {}}, {{4.00000049, -2, 5}, {}}, {{2, 0, 0}, {}}});
  EXPECT_EQ(las.Min(), Eigen::Vector3d(1, -2, -3));
  EXPECT_EQ(las.Max(), las.Position(1).cwiseMax(las.Position(0)));
}

/// 32-bit integers cannot hold millionths of everything.
TEST_F(WriteLasTest, TheScaleGrowsWithTheExtent) {
  for (const double extent : {1e3, 3e3, 1e5, 7e9, 1e30, 1e300}) {
    const std::vector<ColouredPoint> points = {{{-extent, 0, 2}, {}}, {{extent, 1, 3}, {}}};
    const LasBytes las = Written(points);
    const double scale = las.Scale().x();
    EXPECT_NEAR(std::log10(scale), std::round(std::log10(scale)), 1e-9);
    EXPECT_TRUE(scale == 1e-6 || 2 * extent / scale > 0.1 * std::pow(2, 31)) << scale;
    for (size_t i = 0; i < points.size(); ++i) {
      EXPECT_LE(std::abs(las.Position(i).x() - points[i].position.x()),
                0.5 * scale * (1 + 1e-9) + 1e-15 * extent);
    }
  }
}

TEST_F(WriteLasTest, KeepsFarPointsApart) {
  const Eigen::Vector3d utm(500123.456, 5412345.678, 321.5);
  const LasBytes las = Written({{utm, {}}, {utm + Eigen::Vector3d(0.001, 0.002, 0.003), {}}});
  EXPECT_LT((las.Position(1) - las.Position(0) - Eigen::Vector3d(0.001, 0.002, 0.003)).norm(),
            3e-6);
}

TEST_F(WriteLasTest, OfNoPointsIsAHeader) {
  const LasBytes las = Written({});
  EXPECT_EQ(las.bytes().size(), kHeaderBytes);
  EXPECT_EQ(las.At<uint32_t>(107), 0u);
}

TEST_F(WriteLasTest, TheSamePointsGiveTheSameBytes) {
  const std::vector<ColouredPoint> points = {{{1, 2, 3}, {4, 5, 6}}};
  EXPECT_EQ(Written(points).bytes(), Written(points).bytes());
}

TEST_F(WriteLasTest, ASystemIsNamedByGeoTiffKeys) {
  WriteLas(file_, std::vector<ColouredPoint>{{{500123.456, 5412345.678, 321.5}, {1, 2, 3}}}, 32632);
  const LasBytes las(ReadAll(file_));
  const auto points = las.At<uint32_t>(96);
  EXPECT_EQ(points, kHeaderBytes + 54 + 32);
  EXPECT_EQ(las.bytes().size(), points + kRecordBytes);
  EXPECT_EQ(las.At<uint32_t>(100), 1u);  // one record of variable length
  EXPECT_EQ(las.bytes().substr(kHeaderBytes + 2, 15), "LASF_Projection");
  EXPECT_EQ(las.At<uint16_t>(kHeaderBytes + 18), 34735);
  EXPECT_EQ(las.At<uint16_t>(kHeaderBytes + 20), 32);
  bool names_system = false;
  for (size_t key = kHeaderBytes + 54 + 8; key < points; key += 8)
    names_system |= las.At<uint16_t>(key) == 3072 && las.At<uint16_t>(key + 6) == 32632;
  EXPECT_TRUE(names_system);
}

TEST_F(WriteLasTest, ErrorsNameTheFile) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const std::vector<ColouredPoint> broken = {{{1, 2, 3}, {}}, {{0, kNaN, 0}, {}}};
  EXPECT_THAT(ErrorOf([&] { WriteLas(file_, broken); }),
              testing::AllOf(HasSubstr("points.las"), HasSubstr("point 1 is not finite")));
  EXPECT_FALSE(std::filesystem::exists(file_));
  constexpr double kMost = std::numeric_limits<double>::max();
  const std::vector<ColouredPoint> apart = {{{-kMost, 0, 0}, {}}, {{kMost, 0, 0}, {}}};
  EXPECT_THAT(ErrorOf([&] { WriteLas(file_, apart); }), HasSubstr("points.las"));
  EXPECT_THAT(ErrorOf([&] { WriteLas(folder_.path() / "none/points.las", {}); }),
              HasSubstr("none/points.las"));
}

}  // namespace
}  // namespace deepuav
