#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace deepuav {

enum class TextAnchor { kStart, kMiddle, kEnd };

/// Text as XML character data.
std::string EscapeXml(const std::string& text);

/// Writes an SVG picture, front to back in order of calls. Coordinates in pixels, y down; the same
/// calls give the same text.
class SvgWriter {
 public:
  SvgWriter(double width, double height);

  void Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const std::string& colour,
            double width);
  /// Leaves out points too near to the previous one to be seen.
  void Polyline(const std::vector<Eigen::Vector2d>& points, const std::string& colour,
                double width);
  void Rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size,
                 const std::string& fill, const std::string& stroke);
  void Circle(const Eigen::Vector2d& centre, double radius, const std::string& fill);
  /// `rotation_deg`: about the position.
  void Text(const Eigen::Vector2d& position, const std::string& text, TextAnchor anchor,
            double size, double rotation_deg = 0);

  /// What is drawn until EndClip is seen only inside this rectangle.
  void BeginClip(const Eigen::Vector2d& corner, const Eigen::Vector2d& size);
  void EndClip();

  /// The whole document.
  std::string Document() const;

 private:
  std::string head_, body_;
  int clips_ = 0;
};

}  // namespace deepuav
