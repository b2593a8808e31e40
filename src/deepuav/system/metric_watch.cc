#include "deepuav/system/metric_watch.h"

#include <utility>

#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

constexpr size_t kWaitingPoses = 256;

}  // namespace

MetricWatch::MetricWatch(ImuStream imu, const InertialOptions& options, Tell tell)
    : imu_(std::move(imu)),
      tell_(std::move(tell)),
      poses_(kWaitingPoses),
      running_(imu_, options),
      thread_([this] { Work(); }) {}

MetricWatch::~MetricWatch() {
  poses_.Close();
  thread_.join();
}

void MetricWatch::OnFrame(const FrameRecord& record, const Frame& /*frame*/) {
  if (!record.located()) return;
  {
    const std::scoped_lock lock(mutex_);
    if (known_.contains(record.map)) return;
  }
  poses_.TryPush({{record.time, record.cam_from_world.Inverse()}, record.map, record.map_revision});
}

void MetricWatch::OnGauge(MapId map, int64_t /*revision*/, const Gauge& gauge) {
  if (gauge.kind == GaugeKind::kFree) return;
  const std::scoped_lock lock(mutex_);
  known_.insert(map);
}

void MetricWatch::Work() {
  std::optional<SeenPose> last;
  while (const std::optional<SeenPose> seen = poses_.Pop()) {
    const bool goes_on = last && last->map == seen->map && last->revision == seen->revision &&
                         last->pose.time < seen->pose.time;
    if (!goes_on) running_.Restart();
    last = seen;
    const std::optional<MetricWorld> news = running_.Add(seen->pose);
    if (!news) continue;
    Log().info("map {} has metres meanwhile, to {:.1f} %, by the IMU", seen->map.value,
               100 * news->scale_sigma);
    tell_(seen->map, seen->revision, *news);
  }
}

}  // namespace deepuav
