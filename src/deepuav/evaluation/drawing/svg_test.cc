#include "deepuav/evaluation/drawing/svg.h"

#include <gmock/gmock.h>

namespace deepuav {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(SvgWriter, DrawsInTheOrderOfItsCalls) {
  SvgWriter svg(100, 50);
  svg.Rectangle({1, 2}, {3, 4}, "#fff", "none");
  svg.Circle({5, 6}, 2, "#123456");
  svg.Line({0, 0}, {10, 20}, "red", 1.5);
  const std::string text = svg.Document();
  const size_t rectangle = text.find("<rect x=\"1.00\" y=\"2.00\" width=\"3.00\" height=\"4.00\""),
               circle = text.find("<circle cx=\"5.00\" cy=\"6.00\" r=\"2\""),
               line = text.find("<line x1=\"0.00\" y1=\"0.00\" x2=\"10.00\" y2=\"20.00\"");
  ASSERT_NE(line, std::string::npos);
  EXPECT_LT(rectangle, circle);
  EXPECT_LT(circle, line);
  EXPECT_THAT(text, HasSubstr("viewBox=\"0 0 100 50\""));
}

TEST(SvgWriter, LeavesOutPointsThatCannotBeSeenButNotTheLast) {
  SvgWriter svg(10, 10);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i <= 1000; ++i) points.emplace_back(0.001 * i, 0);
  svg.Polyline(points, "red", 1);
  const std::string text = svg.Document();
  EXPECT_LT(Count(text, ",0.00"), 10);
  EXPECT_THAT(text, HasSubstr("points=\"0.00,0.00 "));
  EXPECT_THAT(text, HasSubstr(" 1.00,0.00\""));
}

TEST(SvgWriter, ALineOfNoPointIsNone) {
  SvgWriter svg(10, 10);
  svg.Polyline({}, "red", 1);
  EXPECT_THAT(svg.Document(), Not(HasSubstr("polyline")));
}

TEST(SvgWriter, EveryClipHasANameOfItsOwnAndIsClosed) {
  SvgWriter svg(10, 10);
  for (int i = 0; i < 3; ++i) {
    svg.BeginClip({0, 0}, {5, 5});
    svg.Circle({1, 1}, 1, "red");
    svg.EndClip();
  }
  const std::string text = svg.Document();
  for (const char* id : {"clip0", "clip1", "clip2"}) {
    EXPECT_EQ(Count(text, std::string("id=\"") + id + "\""), 1);
    EXPECT_EQ(Count(text, std::string("url(#") + id + ")"), 1);
  }
  EXPECT_EQ(Count(text, "<g "), Count(text, "</g>"));
}

TEST(SvgWriter, TextOfFilesStaysText) {
  SvgWriter svg(10, 10);
  svg.Text({1, 2}, "</text><script>&\"", TextAnchor::kEnd, 12, -90);
  const std::string text = svg.Document();
  EXPECT_THAT(text, Not(HasSubstr("<script>")));
  EXPECT_THAT(text, HasSubstr("&lt;/text&gt;&lt;script&gt;&amp;&quot;"));
  EXPECT_THAT(text, HasSubstr("text-anchor=\"end\" transform=\"rotate(-90 1.00 2.00)\""));
}

}  // namespace
}  // namespace deepuav
