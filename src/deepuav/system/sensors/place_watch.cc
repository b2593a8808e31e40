#include "deepuav/system/sensors/place_watch.h"

#include <algorithm>

#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

constexpr double kRefusalEvery_s = 10;
/// Without a fix so near in time, poses tell nothing.
constexpr double kNearFix_s = 5;
/// After a change of the map, which may come often.
constexpr double kLeastWait_s = 0.5;

Timestamp Earlier(Timestamp time, double seconds) {
  return {time.nanoseconds - static_cast<int64_t>(1e9 * seconds)};
}

GeoPoint PlaceOf(const GnssFix& fix) {
  return {fix.latitude_deg, fix.longitude_deg, fix.altitude_m.value_or(0)};
}

}  // namespace

PlaceWatch::PlaceWatch(GnssStream gnss, const SensorUseOptions& options, Tell tell)
    : options_(options.georeference),
      tell_(std::move(tell)),
      path_(options_.running_pose_interval_s),
      wait_s_(options_.running_wait_s),
      running_(gnss, options) {
  for (const GnssFix& fix : gnss.fixes) AddFix(fix);
  thread_ = std::thread([this] { Work(); });
}

PlaceWatch::~PlaceWatch() {
  jobs_.Close();
  thread_.join();
}

void PlaceWatch::AddFix(const GnssFix& fix) {
  const std::scoped_lock lock(mutex_);
  if (!fixes_.empty() && fix.time <= fixes_.back().time) return;
  if (!origin_) origin_ = PlaceOf(fix);
  fixes_.push_back(fix);
}

void PlaceWatch::UseOrigin(const GeoPoint& origin) {
  const std::scoped_lock lock(mutex_);
  if (origin_ == origin) return;
  origin_ = origin;
  tried_.reset();  // It is told anew at once.
}

void PlaceWatch::UseMetric(MapId map, int64_t revision, const MetricWorld& world) {
  const std::scoped_lock lock(mutex_);
  metric_ = {{map, revision}, world};
}

void PlaceWatch::OnGauge(MapId map, int64_t /*revision*/, const Gauge& gauge) {
  if (gauge.kind != GaugeKind::kGeoreferenced) return;
  const std::scoped_lock lock(mutex_);
  known_.insert(map);
}

void PlaceWatch::OnMapState(const Map& map) {
  const std::scoped_lock lock(mutex_);
  path_.Follow(map);
}

bool PlaceWatch::HasFixNear(Timestamp time) const {
  const auto after =
      std::ranges::lower_bound(fixes_, Earlier(time, kNearFix_s), {}, &GnssFix::time);
  return after != fixes_.end() && SecondsBetween(time, after->time) <= kNearFix_s;
}

/// What is older than the window at its newest fix that came to lie on the path.
void PlaceWatch::Forget() {
  const Trajectory path = path_.In(tried_->first.map, tried_->first.revision);
  if (path.empty() || fixes_.empty()) return;
  const Timestamp newest = std::min(path.back().time, fixes_.back().time);
  const Timestamp oldest = Earlier(newest, options_.running_window_s);
  path_.ForgetBefore(oldest);
  const auto kept =
      std::ranges::lower_bound(fixes_, Earlier(oldest, kNearFix_s), {}, &GnssFix::time);
  fixes_.erase(fixes_.begin(), kept);
}

bool PlaceWatch::IsDue(const World& world, Timestamp time) const {
  if (!tried_) return true;
  const double wait_s = tried_->first == world ? wait_s_ : kLeastWait_s;
  return std::abs(SecondsBetween(tried_->second, time)) >= wait_s;
}

std::unique_ptr<PlaceWatch::Job> PlaceWatch::JobAt(const FrameRecord& record) {
  const std::scoped_lock lock(mutex_);
  const World world{record.map, record.map_revision};
  if (known_.contains(record.map)) return nullptr;
  if (HasFixNear(record.time)) path_.Add(record);
  if (fixes_.empty() || !IsDue(world, record.time)) return nullptr;
  tried_ = {world, record.time};
  Forget();
  auto job = std::make_unique<Job>();
  job->world = world;
  job->time = record.time;
  job->evidence.path = path_.In(world.map, world.revision);
  job->evidence.fixes = fixes_;
  job->evidence.origin = *origin_;
  job->evidence.camera_world = record.cam_from_world.InverseTranslation();
  if (metric_ && metric_->first == world) job->evidence.metric = metric_->second;
  return job;
}

void PlaceWatch::OnFrame(const FrameRecord& record, const Frame& /*frame*/) {
  if (!record.located()) return;
  if (std::unique_ptr<Job> job = JobAt(record)) jobs_.TryPush(std::move(job));
}

/// Only while there is none though it could be, and seldom.
void PlaceWatch::TellRefusal(const Job& job) {
  const Trajectory& path = job.evidence.path;
  if (path.empty() || SecondsBetween(path.front().time, path.back().time) < kRefusalEvery_s) return;
  if (running_.has_told() || running_.refusal().empty()) return;
  if (refused_at_ && std::abs(SecondsBetween(*refused_at_, job.time)) < kRefusalEvery_s) return;
  refused_at_ = job.time;
  Log().info("map {} has no place on Earth yet: {}", job.world.map.value, running_.refusal());
}

void PlaceWatch::Do(const Job& job) {
  const std::optional<PlacedWorld> news = running_.Find(job.evidence);
  {
    const std::scoped_lock lock(mutex_);
    wait_s_ = running_.has_told() ? std::min(2 * wait_s_, options_.running_longest_wait_s)
                                  : options_.running_wait_s;
  }
  TellRefusal(job);
  if (!news) return;
  Log().info("map {} has its place on Earth meanwhile, to {:.1f} m, by {} fixes",
             job.world.map.value, news->position_sigma_m, news->fixes);
  tell_(job.world.map, job.world.revision, *news);
}

void PlaceWatch::Work() {
  std::unique_ptr<Job> last;
  while (std::optional<std::unique_ptr<Job>> next = jobs_.Pop()) {
    const Job& job = **next;
    if (last && (last->world != job.world || last->evidence.origin != job.evidence.origin))
      running_.Restart();
    Do(job);
    last = std::move(*next);
  }
}

}  // namespace deepuav
