#include "deepuav/system/sensors/metric_watch.h"

#include <utility>

#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

constexpr size_t kWaitingPoses = 256;
constexpr double kRefusalEvery_s = 10;
constexpr double kMostBehind_s = 30;  // Poses that wait or come late, behind the samples.

}  // namespace

MetricWatch::MetricWatch(ImuStream imu, const InertialOptions& options, Tell tell)
    : imu_(std::move(imu), RunningAlignment::KeepSeconds(options, kMostBehind_s)),
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

/// Only while there are none, and seldom.
void MetricWatch::TellRefusal(const SeenPose& seen) {
  if (running_.told() || running_.refusal().empty()) return;
  if (refused_at_ && SecondsBetween(*refused_at_, seen.pose.time) < kRefusalEvery_s) return;
  refused_at_ = seen.pose.time;
  Log().info("map {} has no metres yet: {}", seen.map.value, running_.refusal());
}

void MetricWatch::Work() {
  std::optional<SeenPose> last;
  while (const std::optional<SeenPose> seen = poses_.Pop()) {
    const bool goes_on = last && last->map == seen->map && last->revision == seen->revision &&
                         last->pose.time < seen->pose.time;
    if (!goes_on) running_.Restart();
    last = seen;
    const std::optional<MetricWorld> news = running_.Add(seen->pose);
    TellRefusal(*seen);
    if (!news) continue;
    Log().info("map {} has metres meanwhile, to {:.1f} %, by the IMU", seen->map.value,
               100 * news->scale_sigma);
    tell_(seen->map, seen->revision, *news);
  }
}

}  // namespace deepuav
