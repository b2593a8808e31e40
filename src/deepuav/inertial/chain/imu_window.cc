#include "deepuav/inertial/chain/imu_window.h"

#include <algorithm>

namespace deepuav {
namespace {

/// Of what is kept, by which samples may exceed it: forgetting moves all the others.
constexpr double kSlack = 0.5;

auto FirstFrom(const std::vector<ImuSample>& samples, Timestamp time) {
  return std::lower_bound(
      samples.begin(), samples.end(), time,
      [](const ImuSample& sample, Timestamp other) { return sample.time < other; });
}

}  // namespace

void ImuWindow::Add(const ImuSample& sample) {
  const std::scoped_lock lock(mutex_);
  auto& samples = imu_.samples;
  if (!samples.empty() && sample.time <= samples.back().time) return;
  samples.push_back(sample);
  if (SecondsBetween(samples.front().time, sample.time) <= (1 + kSlack) * keep_s_) return;
  const Timestamp oldest{sample.time.nanoseconds - static_cast<int64_t>(1e9 * keep_s_)};
  samples.erase(samples.begin(), FirstFrom(samples, oldest));
}

ImuStream ImuWindow::Between(Timestamp first, Timestamp end) const {
  const std::scoped_lock lock(mutex_);
  ImuStream between{imu_.source, imu_.noise, imu_.cam_from_imu, {}, imu_.mount_is_known};
  between.samples.assign(FirstFrom(imu_.samples, first), FirstFrom(imu_.samples, end));
  return between;
}

size_t ImuWindow::size() const {
  const std::scoped_lock lock(mutex_);
  return imu_.samples.size();
}

}  // namespace deepuav
