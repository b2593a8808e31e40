#pragma once

#include <functional>
#include <memory>

#include "deepuav/autopilot/autopilot_session.h"
#include "deepuav/autopilot/link_address.h"

namespace deepuav {

/// Tells an autopilot where the vehicle is, by UDP, on a thread of its own from the beginning to
/// the end of its life. Nothing that comes, or does not, holds anything up.
class AutopilotLink {
 public:
  /// Asked once a message, in the link's thread, for the time `now_ns`.
  using Ask = std::function<OdometryEstimator::Answer(int64_t now_ns)>;

  /// `told` is told in the link's thread, and throws nothing. Throws Error where the host is
  /// not known or there is no way to it.
  AutopilotLink(const LinkAddress& address, const AutopilotOptions& options, Ask ask,
                AutopilotListener told = {});
  ~AutopilotLink();
  AutopilotLink(const AutopilotLink&) = delete;
  AutopilotLink& operator=(const AutopilotLink&) = delete;

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace deepuav
