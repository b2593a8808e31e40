#include "deepuav/simulation/world/material_textures.h"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "deepuav/base/random.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

constexpr int kSide = 512;
constexpr int kPrintSide = 1024;
constexpr double kPi = 3.14159265358979323846;

// Strokes that cross the border go on at the other side, so that the tile repeats without a seam.
template <typename Draw>
void DrawRepeated(cv::Mat1f* tile, const cv::Point2d& at, double reach, const Draw& draw) {
  const int side = tile->cols;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const cv::Point2d shifted(at.x + dx * side, at.y + dy * side);
      if (shifted.x < -reach || shifted.y < -reach || shifted.x > side + reach ||
          shifted.y > side + reach)
        continue;
      draw(*tile, shifted);
    }
  }
}

constexpr int kSubpixelBits = 4;
cv::Point Subpixel(const cv::Point2d& point) {
  return {cvRound(point.x * (1 << kSubpixelBits)), cvRound(point.y * (1 << kSubpixelBits))};
}

cv::Point2d Anywhere(int side, Random* random) {
  const double x = random->Uniform(0, side);
  return {x, random->Uniform(0, side)};
}

cv::Mat1f Fractal(int side, int first_period, float persistence, uint32_t seed) {
  cv::Mat1f tile(side, side);
  const int octaves = static_cast<int>(std::log2(side / first_period));
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const float scale = static_cast<float>(first_period) / static_cast<float>(side);
      tile(y, x) = FractalNoise((static_cast<float>(x) + 0.5f) * scale,
                                (static_cast<float>(y) + 0.5f) * scale, first_period, octaves,
                                persistence, seed);
    }
  }
  return tile;
}

struct Strokes {
  int count;
  double min_length_px, max_length_px, width_px;
  double spread;  // Of the grey levels, about 0.
};

void DrawStrokes(cv::Mat1f* tile, const Strokes& strokes, Random* random) {
  for (int i = 0; i < strokes.count; ++i) {
    const cv::Point2d at = Anywhere(tile->cols, random);
    const double length = random->Uniform(strokes.min_length_px, strokes.max_length_px);
    const double angle = random->Uniform(0, 2 * kPi);
    const double level = random->Uniform(-strokes.spread, strokes.spread);
    const int width = std::max(1, cvRound(strokes.width_px * random->Uniform(0.6, 1.4)));
    const cv::Point2d along(length * std::cos(angle), length * std::sin(angle));
    DrawRepeated(tile, at, length, [&](cv::Mat1f& image, const cv::Point2d& start) {
      cv::line(image, Subpixel(start), Subpixel(start + along), cv::Scalar(level), width,
               cv::LINE_8, kSubpixelBits);
    });
  }
}

// Blobs with a lit and a shaded side.
void DrawClods(cv::Mat1f* tile, int count, double min_radius, double max_radius, double spread,
               double roundness, Random* random) {
  for (int i = 0; i < count; ++i) {
    const cv::Point2d at = Anywhere(tile->cols, random);
    // Many small ones, few large ones.
    const double radius =
        min_radius * std::pow(max_radius / min_radius, std::pow(random->Uniform(0, 1), 2.0));
    const double angle = random->Uniform(0, 180), level = random->Uniform(-spread, spread);
    const cv::Size axes = Subpixel({radius, radius * random->Uniform(roundness, 1)});
    DrawRepeated(tile, at, 2 * radius, [&](cv::Mat1f& image, const cv::Point2d& centre) {
      const auto blob = [&](const cv::Point2d& offset, double grey) {
        cv::ellipse(image, Subpixel(centre + offset), axes, angle, 0, 360, cv::Scalar(grey),
                    cv::FILLED, cv::LINE_8, kSubpixelBits);
      };
      blob({0.3 * radius, 0.3 * radius}, level - 0.7 * spread);
      blob({0, 0}, level + 0.25 * spread);
    });
  }
}

void DrawCrack(cv::Mat1f* tile, double level, Random* random) {
  cv::Point2d at = Anywhere(tile->cols, random);
  double heading = random->Uniform(0, 2 * kPi);
  const int steps = 20 + random->Index(50);
  for (int i = 0; i < steps; ++i) {
    heading += random->Gaussian(0.35);
    const cv::Point2d step(6 * std::cos(heading), 6 * std::sin(heading));
    DrawRepeated(tile, at, 8, [&](cv::Mat1f& image, const cv::Point2d& start) {
      cv::line(image, Subpixel(start), Subpixel(start + step), cv::Scalar(level), 1, cv::LINE_8,
               kSubpixelBits);
    });
    at += step;
    at.x -= tile->cols * std::floor(at.x / tile->cols);
    at.y -= tile->rows * std::floor(at.y / tile->rows);
  }
}

// Bricks, tiles, planks and paving: courses of blocks with joints.
struct Courses {
  int rows, columns;
  double joint_px;
  double joint_level;
  double block_spread;
  double shading;  // Darker towards the lower edge, as overlapping tiles are.
  bool staggered;
};

void DrawCourses(cv::Mat1f* tile, const Courses& courses, Random* random) {
  const double row_height = static_cast<double>(tile->rows) / courses.rows;
  const double column_width = static_cast<double>(tile->cols) / courses.columns;
  const auto seed = static_cast<uint32_t>(random->Index(1 << 30));
  for (int y = 0; y < tile->rows; ++y) {
    const int row = static_cast<int>(y / row_height);
    const double down = y / row_height - row;
    const double shift = courses.staggered && row % 2 == 1 ? 0.5 : 0;
    for (int x = 0; x < tile->cols; ++x) {
      const double across = x / column_width + shift;
      const int column = static_cast<int>(across) % courses.columns;
      const double joint =
          std::min(std::min(across - std::floor(across), std::ceil(across) - across) * column_width,
                   std::min(down, 1 - down) * row_height);
      const double block =
          courses.block_spread * (2 * UnitFromHash(HashCell(column, row, seed)) - 1);
      (*tile)(y, x) +=
          static_cast<float>(joint < courses.joint_px / 2 ? courses.joint_level
                                                          : block + courses.shading * (0.5 - down));
    }
  }
}

cv::Mat1f MakeTile(Material material, uint32_t seed, Random* random) {
  cv::Mat1f tile;
  switch (material) {
    case Material::kNoise:
      return Fractal(kSide, 4, 0.95f, seed);
    case Material::kGrass:
      tile = 0.6 * Fractal(kSide, 8, 0.9f, seed);
      DrawStrokes(&tile, {14000, 3, 12, 1, 0.6}, random);
      DrawClods(&tile, 120, 3, 14, 0.7, 0.5, random);
      DrawStrokes(&tile, {9000, 3, 10, 1.5, 0.8}, random);
      return tile;
    case Material::kLeaves:
      tile = Fractal(kSide, 8, 0.7f, seed) - 0.4;
      DrawClods(&tile, 6000, 4, 9, 0.5, 0.4, random);
      return tile;
    case Material::kSoil:
      tile = Fractal(kSide, 4, 0.9f, seed);
      DrawClods(&tile, 1500, 1.5, 10, 0.35, 0.6, random);
      return tile + 0.5 * Fractal(kSide, 16, 0.9f, seed + 1);
    case Material::kGravel:
      tile = Fractal(kSide, 4, 0.8f, seed);
      DrawClods(&tile, 9000, 2, 7, 0.6, 0.6, random);
      return tile;
    case Material::kAsphalt:
      tile = 0.6 * Fractal(kSide, 8, 1, seed);
      DrawStrokes(&tile, {9000, 1, 3, 1, 0.9}, random);
      for (int i = 0; i < 14; ++i) DrawCrack(&tile, -1.4, random);
      return tile;
    case Material::kConcrete:
      tile = Fractal(kSide, 4, 0.8f, seed);
      DrawStrokes(&tile, {300, 2, 6, 1, 1}, random);
      DrawCourses(&tile, {2, 2, 4, -1.2, 0.25, 0, false}, random);
      for (int i = 0; i < 5; ++i) DrawCrack(&tile, -0.9, random);
      return tile;
    case Material::kPlaster:
      return Fractal(kSide, 4, 0.75f, seed);
    case Material::kBricks:
      tile = 0.4 * Fractal(kSide, 4, 0.9f, seed);
      DrawCourses(&tile, {16, 8, 4, 0.5, 0.4, 0, true}, random);
      return tile;
    case Material::kRoofTiles:
      tile = 0.6 * Fractal(kSide, 4, 0.9f, seed);
      DrawCourses(&tile, {16, 20, 3, -0.8, 0.35, 0.7, true}, random);
      return tile;
    case Material::kPlanks:
      tile = 0.5 * Fractal(kSide, 4, 0.9f, seed);
      cv::resize(tile, tile, {}, 1, 1.0 / 8, cv::INTER_AREA);
      cv::resize(tile, tile, {kSide, kSide}, 0, 0, cv::INTER_LINEAR);
      DrawCourses(&tile, {12, 3, 3, -1, 0.35, 0, true}, random);
      return tile;
    case Material::kPaving:
      tile = 0.7 * Fractal(kSide, 4, 0.9f, seed);
      DrawCourses(&tile, {8, 8, 4, -0.9, 0.35, 0, true}, random);
      return tile;
    case Material::kRipples:
      return Fractal(kSide, 8, 0.6f, seed);
    case Material::kPrint:
      break;
  }
  return tile;
}

void DrawPrint(cv::Mat1f* page, Random* random) {
  const int side = page->cols;
  page->setTo(random->Uniform(-1, 1));
  for (int i = 0; i < 14; ++i) {
    const cv::Point corner = Anywhere(side, random);
    const cv::Size size(10 + random->Index(side / 2), 10 + random->Index(side / 3));
    cv::rectangle(*page, {corner, size}, cv::Scalar(random->Uniform(-1, 1)), cv::FILLED);
  }
  for (int i = 0; i < 8; ++i) {
    cv::circle(*page, Anywhere(side, random), 5 + random->Index(side / 6),
               cv::Scalar(random->Uniform(-1, 1)), random->Index(2) == 0 ? cv::FILLED : 6);
  }
  for (int i = 0; i < 12; ++i) {
    std::string word;
    const int letters = 3 + random->Index(9);
    for (int k = 0; k < letters; ++k) word += static_cast<char>('A' + random->Index(26));
    cv::putText(*page, word, Anywhere(side, random) - cv::Point2d(side / 6.0, 0),
                cv::FONT_HERSHEY_SIMPLEX, random->Uniform(0.4, 1.6),
                cv::Scalar(random->Uniform(-1, 1)), 1 + random->Index(4));
  }
}

cv::Mat1f MakePrints(uint32_t seed, Random* random) {
  cv::Mat1f tile(kPrintSide, kPrintSide);
  const int side = kPrintSide / 4;
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) {
      cv::Mat1f page(side, side);
      DrawPrint(&page, random);
      page.copyTo(tile(cv::Rect(x * side, y * side, side, side)));
    }
  }
  return tile + 0.3 * Fractal(kPrintSide, 4, 0.8f, seed);
}

// To 8 bits with the mean in the middle and 2.5 standard deviations to either end.
cv::Mat1b Levels(const cv::Mat1f& tile) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(tile, mean, deviation);
  const double scale = 127.5 / (2.5 * deviation[0]);
  cv::Mat1b levels;
  tile.convertTo(levels, CV_8U, scale, 127.5 - scale * mean[0]);
  return levels;
}

}  // namespace

MaterialTextures::MaterialTextures(uint32_t seed) {
  for (int i = 0; i < kMaterialCount; ++i) {
    const auto material = static_cast<Material>(i);
    const uint32_t tile_seed = HashCell(i, 0, seed);
    Random random(tile_seed);
    const cv::Mat1f tile = material == Material::kPrint ? MakePrints(tile_seed, &random)
                                                        : MakeTile(material, tile_seed, &random);
    textures_.emplace_back(Levels(tile), MipTexture::Edge::kRepeat);
  }
}

}  // namespace deepuav
