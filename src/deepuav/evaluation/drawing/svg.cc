#include "deepuav/evaluation/drawing/svg.h"

#include <fmt/format.h>

#include <iterator>

namespace deepuav {
namespace {

constexpr double kSeenDistance = 0.2;  // Pixels.
constexpr const char* kAnchorNames[] = {"start", "middle", "end"};

}  // namespace

std::string EscapeXml(const std::string& text) {
  std::string escaped;
  for (const char character : text) {
    switch (character) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += character;
    }
  }
  return escaped;
}

SvgWriter::SvgWriter(double width, double height)
    : head_(
          fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
                      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:g}\" height=\"{1:g}\" "
                      "viewBox=\"0 0 {0:g} {1:g}\" font-family=\"Helvetica, Arial, sans-serif\" "
                      "fill=\"#222\">\n",
                      width, height)) {}

void SvgWriter::Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                     const std::string& colour, double width) {
  body_ += fmt::format(
      "<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" stroke=\"{}\" "
      "stroke-width=\"{:g}\"/>\n",
      from.x(), from.y(), to.x(), to.y(), colour, width);
}

void SvgWriter::Polyline(const std::vector<Eigen::Vector2d>& points, const std::string& colour,
                         double width) {
  if (points.empty()) return;
  body_ += fmt::format(
      "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"{:g}\" stroke-linejoin=\"round\" "
      "stroke-linecap=\"round\" points=\"",
      colour, width);
  const Eigen::Vector2d* last = nullptr;
  for (size_t i = 0; i < points.size(); ++i) {
    const bool is_seen = !last || (points[i] - *last).norm() >= kSeenDistance;
    if (!is_seen && i + 1 < points.size()) continue;
    fmt::format_to(std::back_inserter(body_), "{}{:.2f},{:.2f}", last ? " " : "", points[i].x(),
                   points[i].y());
    last = &points[i];
  }
  body_ += "\"/>\n";
}

void SvgWriter::Rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size,
                          const std::string& fill, const std::string& stroke) {
  body_ += fmt::format(
      "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"{}\" "
      "stroke=\"{}\"/>\n",
      corner.x(), corner.y(), size.x(), size.y(), fill, stroke);
}

void SvgWriter::Circle(const Eigen::Vector2d& centre, double radius, const std::string& fill) {
  body_ += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:g}\" fill=\"{}\"/>\n", centre.x(),
                       centre.y(), radius, fill);
}

void SvgWriter::Text(const Eigen::Vector2d& position, const std::string& text, TextAnchor anchor,
                     double size, double rotation_deg) {
  body_ += fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"{:g}\" text-anchor=\"{}\"",
                       position.x(), position.y(), size, kAnchorNames[static_cast<int>(anchor)]);
  if (rotation_deg != 0) {
    body_ += fmt::format(" transform=\"rotate({:g} {:.2f} {:.2f})\"", rotation_deg, position.x(),
                         position.y());
  }
  body_ += fmt::format(">{}</text>\n", EscapeXml(text));
}

void SvgWriter::BeginClip(const Eigen::Vector2d& corner, const Eigen::Vector2d& size) {
  const int clip = clips_++;
  body_ += fmt::format(
      "<clipPath id=\"clip{0}\"><rect x=\"{1:.2f}\" y=\"{2:.2f}\" width=\"{3:.2f}\" "
      "height=\"{4:.2f}\"/></clipPath>\n<g clip-path=\"url(#clip{0})\">\n",
      clip, corner.x(), corner.y(), size.x(), size.y());
}

void SvgWriter::EndClip() { body_ += "</g>\n"; }

std::string SvgWriter::Document() const { return head_ + body_ + "</svg>\n"; }

}  // namespace deepuav
