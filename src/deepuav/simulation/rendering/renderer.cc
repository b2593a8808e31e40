#include "deepuav/simulation/rendering/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "deepuav/simulation/rendering/camera_pose.h"
#include "deepuav/simulation/rendering/camera_rays.h"
#include "deepuav/simulation/rendering/exposure_meter.h"
#include "deepuav/simulation/rendering/flow.h"
#include "deepuav/simulation/rendering/light_tracer.h"
#include "deepuav/simulation/rendering/moving_scene.h"
#include "deepuav/simulation/rendering/parallel_rows.h"
#include "deepuav/simulation/rendering/rain.h"
#include "deepuav/simulation/rendering/sensor.h"
#include "deepuav/simulation/rendering/sky.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

// A packet covers a tile of pixels, for rays that are close together meet the same things.
constexpr int kTileColumns = 4, kTileRows = 2;
static_assert(kTileColumns * kTileRows == RayPacket::kSize);
static_assert(kBandRows % kTileRows == 0, "no tile may lie in the bands of two threads");
constexpr int kLanes = RayPacket::kSize;

template <typename Options>
const Options& Checked(const Options& options) {
  options.Check();
  return options;
}

const Camera& Checked(const Camera& camera) {
  camera.Check("simulated camera");
  return camera;
}

// Places in the pixel that a sequence of low discrepancy (Roberts 2018) spreads evenly, about its
// centre.
std::vector<Vector2f> SampleOffsets(int count) {
  constexpr double kStepX = 0.7548776662466927, kStepY = 0.5698402909980532;
  std::vector<Eigen::Vector2d> offsets;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int i = 0; i < count; ++i) {
    const double x = 0.5 + kStepX * i, y = 0.5 + kStepY * i;
    offsets.emplace_back(x - std::floor(x), y - std::floor(y));
    sum += offsets.back();
  }
  std::vector<Vector2f> centred;
  for (const Eigen::Vector2d& offset : offsets) {
    centred.push_back((offset - sum / count).cast<float>());
  }
  return centred;
}

// The camera while it exposes one row.
struct RowView {
  CameraPose pose;
  float ray_time;
};
using TileView = std::array<RowView, kTileRows>;

}  // namespace

class Renderer::Impl {
 public:
  Impl(const World& world, const Camera& camera, const RenderOptions& options)
      : world_(world.geometry()),
        camera_(Checked(camera)),
        options_(Checked(options)),
        rays_(camera_, options.threads),
        sky_(options.weather, world_.textures()),
        meter_(world_, sky_, camera_, rays_, options.sensor),
        moving_(world_),
        sensor_(options.sensor, {camera.width, camera.height}, static_cast<uint64_t>(options.seed),
                options.threads),
        offsets_(SampleOffsets(options.sensor.samples)) {}

  double RowTime(double time_s, double row) const {
    const double middle = (camera_.height - 1) / 2.0;
    const double span = std::max(1.0, camera_.height - 1.0);
    return time_s + (row - middle) / span * options_.sensor.rolling_shutter_readout_s;
  }

  Rendered Render(const PathOfCamera& path, double time_s, int frame_index,
                  const TruthRequest& truth) {
    const ExposureSetting setting = meter_.Meter(path, time_s);
    Rendered rendered;
    rendered.exposure = {time_s - setting.duration_s / 2, setting.duration_s, setting.gain};
    const double start_s = RowTime(time_s, 0) - setting.duration_s / 2;
    const double end_s = RowTime(time_s, camera_.height - 1) + setting.duration_s / 2;
    const bool instant =
        options_.sensor.samples == 1 && options_.sensor.rolling_shutter_readout_s == 0;
    moving_.SetInterval(instant ? time_s : start_s, instant ? time_s : end_s);
    if (truth.picture) rendered.image = TakePicture(path, time_s, frame_index, setting);
    if (truth.depth || truth.moving || truth.flow_to_time_s)
      FindTruth(path, time_s, truth, &rendered);
    return rendered;
  }

 private:
  GreyImage TakePicture(const PathOfCamera& path, double time_s, int frame_index,
                        const ExposureSetting& setting) {
    cv::Mat1f radiance = options_.sensor.IsBlindAt(time_s)
                             ? cv::Mat1f::zeros(camera_.height, camera_.width)
                             : TraceLight(path, time_s, setting.duration_s);
    return sensor_.Develop(std::move(radiance), setting, frame_index);
  }

  cv::Mat1f TraceLight(const PathOfCamera& path, double time_s, double duration_s) {
    cv::Mat1f radiance(camera_.height, camera_.width);
    const LightTracer tracer(world_, sky_, &moving_);
    ForRowsInParallel(camera_.height, options_.threads, [&](int first, int last) {
      for (int y = first; y < last; y += kTileRows)
        TraceTiles(tracer, path, time_s, duration_s, y, &radiance);
    });
    DrawRain(options_.weather, camera_,
             {path(time_s - duration_s / 2), path(time_s + duration_s / 2), time_s - duration_s / 2,
              time_s + duration_s / 2, sky_.Radiance(Vector3f(0.5f, 0.5f, 0.7f).normalized())},
             static_cast<uint64_t>(options_.seed), &radiance);
    return radiance;
  }

  // Rows y to y + kTileRows - 1.
  void TraceTiles(const LightTracer& tracer, const PathOfCamera& path, double time_s,
                  double duration_s, int y, cv::Mat1f* radiance) const {
    const int samples = options_.sensor.samples;
    const float share = 1.0f / static_cast<float>(samples);
    const float pixel_size = rays_.pixel_size() * std::sqrt(share);
    for (int row = y; row < std::min(y + kTileRows, camera_.height); ++row)
      std::fill_n((*radiance)[row], camera_.width, 0.0f);
    for (int sample = 0; sample < samples; ++sample) {
      const double shift_s = ((sample + 0.5) / samples - 0.5) * duration_s;
      const TileView view = ViewOf(path, time_s, shift_s, y);
      for (int x = 0; x < camera_.width; x += kTileColumns) {
        RayPacket packet;
        FillPacket(view, x, y, offsets_[static_cast<size_t>(sample)], &packet);
        const std::array<float, kLanes> light = tracer.Radiance(&packet, pixel_size);
        ForLanes(x, y, [&](int lane, int column, int row) {
          (*radiance)(row, column) += share * light[static_cast<size_t>(lane)];
        });
      }
    }
  }

  // The rows from y on, `shift_s` from the middles of their exposures.
  TileView ViewOf(const PathOfCamera& path, double time_s, double shift_s, int y) const {
    const auto row_view = [&](int row) {
      const double at = RowTime(time_s, row) + shift_s;
      return RowView{CameraPose(path(at)), moving_.RayTime(at)};
    };
    static_assert(kTileRows == 2);
    return {row_view(y), row_view(std::min(y + 1, camera_.height - 1))};
  }

  // Calls `visit` with the lanes of the tile at (x, y), and their pixels, that are in the picture.
  template <typename Visit>
  void ForLanes(int x, int y, const Visit& visit) const {
    const int columns = std::min(kTileColumns, camera_.width - x);
    const int rows = std::min(kTileRows, camera_.height - y);
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column)
        visit(row * kTileColumns + column, x + column, y + row);
    }
  }

  void FillPacket(const TileView& view, int x, int y, const Vector2f& offset,
                  RayPacket* packet) const {
    const bool centred = offset.isZero(0);
    ForLanes(x, y, [&](int lane, int column, int row) {
      const Vector2f ray = centred ? rays_.At(column, row) : rays_.At(column, row, offset);
      if (std::isnan(ray.x()) || std::isnan(ray.y())) return;
      const auto& [pose, ray_time] = view[static_cast<size_t>(lane / kTileColumns)];
      packet->Set(lane, pose.position, pose.rotation * Vector3f(ray.x(), ray.y(), 1), ray_time);
    });
  }

  void FindTruth(const PathOfCamera& path, double time_s, const TruthRequest& truth,
                 Rendered* rendered) {
    const cv::Size size(camera_.width, camera_.height);
    const bool global = options_.sensor.rolling_shutter_readout_s == 0;
    std::optional<RowwiseProjection> other;
    if (truth.depth) rendered->depth_m = cv::Mat1f::zeros(size);
    if (truth.moving) rendered->moving = cv::Mat1b(size, kStanding);
    if (truth.flow_to_time_s) {
      const float nan = std::numeric_limits<float>::quiet_NaN();
      rendered->flow_px = cv::Mat2f(size, cv::Vec2f(nan, nan));
      const double to_s = *truth.flow_to_time_s;
      other.emplace(camera_, global,
                    [&](double row) { return path(global ? to_s : RowTime(to_s, row)); });
    }
    const LightTracer tracer(world_, sky_, &moving_);
    ForRowsInParallel(camera_.height, options_.threads, [&](int first, int last) {
      for (int y = first; y < last; y += kTileRows) {
        const TileView view = ViewOf(path, time_s, 0, y);
        for (int x = 0; x < camera_.width; x += kTileColumns) {
          RayPacket packet;
          FillPacket(view, x, y, Vector2f::Zero(), &packet);
          tracer.Intersect(&packet);
          if (truth.moving) MarkMoving(tracer, packet, x, y, &rendered->moving);
          ForLanes(x, y, [&](int lane, int column, int row) {
            if (!packet.Hits(lane)) return;
            if (truth.depth) rendered->depth_m(row, column) = packet.Depth(lane);
            if (!other) return;
            const auto pixel = LaterPixel(*other, tracer.PointAt(packet, lane), time_s,
                                          *truth.flow_to_time_s, row);
            if (pixel) {
              rendered->flow_px(row, column) = cv::Vec2f(static_cast<float>(pixel->x() - column),
                                                         static_cast<float>(pixel->y() - row));
            }
          });
        }
      }
    });
  }

  // The tile at (x, y), whose rays have met what they meet.
  void MarkMoving(const LightTracer& tracer, const RayPacket& packet, int x, int y,
                  cv::Mat1b* moving) const {
    const std::array<bool, kLanes> shaded = tracer.InMovingShadow(packet);
    ForLanes(x, y, [&](int lane, int column, int row) {
      const auto i = static_cast<size_t>(lane);
      if (packet.Hits(lane) && packet.moving[i]) (*moving)(row, column) = kMoving;
      if (shaded[i]) (*moving)(row, column) = kMovingShadow;
    });
  }

  std::optional<Eigen::Vector2d> LaterPixel(const RowwiseProjection& other,
                                            const SurfacePoint& point, double from_s, double to_s,
                                            int row) const {
    if (!point.moving) {
      const Eigen::Vector3d position = point.position.cast<double>();
      return other.Project([&](double) { return position; }, row);
    }
    const Traffic& traffic = world_.outdoors()->traffic;
    const Traffic::Mover& mover = traffic.movers()[point.geometry];
    if (traffic.Jumps(mover, RowTime(from_s, row), RowTime(to_s, row))) return std::nullopt;
    const auto position_at = [&](double other_row) {
      const Placement placement = traffic.PlacementAt(mover, RowTime(to_s, other_row));
      return Eigen::Vector3d((placement * point.object_position.homogeneous()).cast<double>());
    };
    return other.Project(position_at, row);
  }

  const WorldGeometry& world_;
  Camera camera_;
  RenderOptions options_;
  CameraRays rays_;
  Sky sky_;
  ExposureMeter meter_;
  MovingScene moving_;
  Sensor sensor_;
  std::vector<Vector2f> offsets_;
};

Renderer::Renderer(const World& world, const Camera& camera, const RenderOptions& options)
    : impl_(std::make_unique<Impl>(world, camera, options)) {}

Renderer::~Renderer() = default;

Rendered Renderer::Render(const PathOfCamera& world_from_cam, double time_s, int frame_index,
                          const TruthRequest& truth) {
  return impl_->Render(world_from_cam, time_s, frame_index, truth);
}

double Renderer::RowTime(double time_s, double row) const { return impl_->RowTime(time_s, row); }

}  // namespace deepuav
