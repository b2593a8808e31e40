#include "deepuav/system/sensors/place_watch.h"

#include <algorithm>
#include <cmath>
#include <ranges>

#include "deepuav/base/logging.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {
namespace {

constexpr double kRefusalEvery_s = 10;
/// Fixes may come that much later than images, beside what their clock may be off.
constexpr double kLate_s = 5;
/// After a change of the map, which may come often.
constexpr double kLeastWait_s = 0.5;
/// Of an origin: beyond, its plane is not level where the fixes are, and within, it is the same.
constexpr double kFarOrigin_m = 50'000, kSameOrigin_m = 0.1;
/// As FindGeoreference searches.
constexpr double kClockSigmas = 2;
/// How level a map is whose gauge is metric.
constexpr double kGaugeTilt_rad = 0.01;
/// Of what was known of maps, the newest.
constexpr size_t kMostMetrics = 16;

Timestamp Later(Timestamp time, double seconds) {
  return {time.nanoseconds + static_cast<int64_t>(1e9 * seconds)};
}

/// The fixes come on the camera's clock.
SensorUseOptions OnCamerasClock(SensorUseOptions options) {
  options.gnss_clock_offset_s = 0;
  return options;
}

}  // namespace

PlaceWatch::PlaceWatch(GnssStream gnss, const SensorUseOptions& options, Tell tell)
    : options_(options.georeference),
      clock_offset_s_(options.gnss_clock_offset_s),
      near_s_(kLate_s + kClockSigmas * (options.search_gnss_clock ? gnss.clock_sigma_s : 0)),
      nothing_told_(gnss, OnCamerasClock(options)),
      tell_(std::move(tell)),
      path_(options_.running_pose_interval_s),
      wait_s_(options_.running_wait_s) {
  for (const GnssFix& fix : gnss.fixes) Add(fix);
  thread_ = std::thread([this] { Work(); });
}

PlaceWatch::~PlaceWatch() {
  {
    const std::scoped_lock lock(mutex_);
    is_over_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void PlaceWatch::Add(GnssFix fix) {
  fix.time = Later(fix.time, clock_offset_s_);
  if (!fixes_.empty() && fix.time <= fixes_.back().time) return;
  if (!first_fix_) first_fix_ = PlaceOf(fix);
  fixes_.push_back(fix);
}

void PlaceWatch::AddFix(const GnssFix& fix) {
  const std::scoped_lock lock(mutex_);
  Add(fix);
  if (!shown_until_) return;  // All may come before the first image.
  const Timestamp newest = std::min(*shown_until_, fixes_.back().time);
  ForgetBefore(Later(newest, -options_.running_window_s));
}

void PlaceWatch::UseOrigin(const GeoPoint& origin) {
  const std::scoped_lock lock(mutex_);
  if (origin_ && LocalFromGeo(*origin_, origin).norm() < kSameOrigin_m) return;
  origin_ = origin;
  warned_of_origin_ = false;
  tried_.reset();  // It is told anew at once.
}

/// That which was asked for, where the fixes are near.
GeoPoint PlaceWatch::Origin() {
  if (!origin_) return *first_fix_;
  const double apart_m = LocalFromGeo(*origin_, *first_fix_).norm();
  if (apart_m <= kFarOrigin_m) return *origin_;
  if (!std::exchange(warned_of_origin_, true)) {
    Log().warn("an origin {:.0f} km from the fixes is left aside: places are told from the first",
               1e-3 * apart_m);
  }
  return *first_fix_;
}

void PlaceWatch::UseMetric(MapId map, int64_t revision, const MetricWorld& world) {
  const std::scoped_lock lock(mutex_);
  metrics_.push_back({{map, revision}, false, world});
  if (metrics_.size() > kMostMetrics) metrics_.erase(metrics_.begin());
}

void PlaceWatch::OnGauge(MapId map, int64_t revision, const Gauge& gauge) {
  const std::scoped_lock lock(mutex_);
  if (gauge.kind == GaugeKind::kGeoreferenced) known_.insert(map);
  if (gauge.kind == GaugeKind::kMetric)
    metrics_.push_back({{map, revision}, true, {Sim3(), gauge.scale_sigma, kGaugeTilt_rad}});
}

std::optional<MetricWorld> PlaceWatch::MetricOf(const World& world) const {
  for (const KnownMetric& known : std::views::reverse(metrics_)) {
    const bool was_before = known.world.map == world.map && known.world.revision < world.revision;
    if (known.world == world || (known.lasts && was_before)) return known.metric;
  }
  return std::nullopt;
}

void PlaceWatch::OnMapState(const Map& map) {
  const std::scoped_lock lock(mutex_);
  path_.Follow(map);
}

bool PlaceWatch::HasFixNear(Timestamp time) const {
  const auto after = std::ranges::lower_bound(fixes_, Later(time, -near_s_), {}, &GnssFix::time);
  return after != fixes_.end() && SecondsBetween(time, after->time) <= near_s_;
}

void PlaceWatch::ForgetBefore(Timestamp time) {
  path_.ForgetBefore(time);
  const auto kept = std::ranges::lower_bound(fixes_, Later(time, -near_s_), {}, &GnssFix::time);
  fixes_.erase(fixes_.begin(), kept);
}

/// What is older than the window at its newest fix that came to lie on the path.
void PlaceWatch::ForgetOld() {
  const Trajectory path = path_.In(tried_->first.map, tried_->first.revision);
  if (path.empty()) return;
  ForgetBefore(Later(std::min(path.back().time, fixes_.back().time), -options_.running_window_s));
}

bool PlaceWatch::IsDue(const World& world, Timestamp time) const {
  if (!tried_) return true;
  const double wait_s = tried_->first == world ? wait_s_ : kLeastWait_s;
  return std::abs(SecondsBetween(tried_->second, time)) >= wait_s;
}

void PlaceWatch::PrepareJob(const FrameRecord& record) {
  const World world{record.map, record.map_revision};
  if (known_.contains(record.map)) return path_.Clear();
  if (HasFixNear(record.time)) path_.Add(record);
  if (fixes_.empty() || !IsDue(world, record.time)) return;
  if (tried_ && tried_->first != world) wait_s_ = options_.running_wait_s;
  tried_ = {world, record.time};
  ForgetOld();
  job_ = std::make_unique<Job>();
  job_->world = world;
  job_->time = record.time;
  job_->evidence.path = path_.In(world.map, world.revision);
  job_->evidence.fixes = fixes_;
  job_->evidence.origin = Origin();
  job_->evidence.metric = MetricOf(world);
  job_->evidence.camera_world = record.cam_from_world.InverseTranslation();
}

void PlaceWatch::OnFrame(const FrameRecord& record, const Frame& /*frame*/) {
  const std::scoped_lock lock(mutex_);
  shown_until_ = record.time;
  if (!record.located()) return;
  PrepareJob(record);
  if (job_) changed_.notify_one();
}

/// Only while there is none though it could be, and seldom.
void PlaceWatch::TellRefusal(const Job& job, const RunningPlace& running) {
  const Trajectory& path = job.evidence.path;
  if (path.empty() || SecondsBetween(path.front().time, path.back().time) < kRefusalEvery_s) return;
  if (running.has_told() || running.refusal().empty()) return;
  if (refused_at_ && std::abs(SecondsBetween(*refused_at_, job.time)) < kRefusalEvery_s) return;
  refused_at_ = job.time;
  Log().info("map {} has no place on Earth yet: {}", job.world.map.value, running.refusal());
}

/// A map that is corrected keeps its world, about, and one that is left and found again wholly:
/// what was told of it holds until it is contradicted.
void PlaceWatch::Do(const Job& job) {
  RunningPlace& running = running_.try_emplace(job.world.map, nothing_told_).first->second;
  const std::optional<PlacedWorld> news = running.Find(job.evidence);
  {
    const std::scoped_lock lock(mutex_);
    wait_s_ = running.has_told() ? std::min(2 * wait_s_, options_.running_longest_wait_s)
                                 : options_.running_wait_s;
  }
  TellRefusal(job, running);
  if (!news) return;
  Log().info("map {} has its place on Earth meanwhile, to {:.1f} m, by {} fixes",
             job.world.map.value, news->position_sigma_m, news->fixes);
  tell_(job.world.map, job.world.revision, *news);
}

/// Null at the end.
std::unique_ptr<PlaceWatch::Job> PlaceWatch::NextJob() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return job_ || is_over_; });
  return std::move(job_);
}

void PlaceWatch::Work() {
  while (const std::unique_ptr<Job> job = NextJob()) Do(*job);
}

}  // namespace deepuav
