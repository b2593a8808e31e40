#pragma once

#include <nanobind/nanobind.h>

#include <cstdint>
#include <string>

#include "deepuav/api/observer.h"

namespace deepuav::python {

namespace nb = nanobind;

std::string NameOf(api::FrameState state);

/// Functions of Python, each None or absent where it is not to be called.
struct WatchFunctions {
  nb::object on_frame, on_keyframe, on_map;  ///< With a dict.
  nb::object on_restart;                     ///< With nothing.
  nb::object on_dropped;                     ///< With a number.
};

/// Hands events to functions of Python. What they raise is printed as other exceptions that nobody
/// can catch.
class Callbacks : public api::Observer {
 public:
  explicit Callbacks(WatchFunctions functions);
  Callbacks(const Callbacks&) = delete;
  Callbacks& operator=(const Callbacks&) = delete;
  ~Callbacks() override;

  void OnFrame(const api::FrameEvent& event) override;
  void OnKeyframe(const api::KeyframeEvent& event) override;
  void OnMap(const api::MapEvent& event) override;
  void OnRestart() override;
  void OnDropped(std::int64_t dropped) override;

  /// Whether any function is to be called.
  bool IsHeard() const;
  /// For the interpreter's search for circles of objects.
  int Visit(visitproc visit, void* arg) const;
  /// Nothing is told from now on.
  void Clear();

 private:
  /// `tell` is given the function, if there is one.
  template <typename Tell>
  void Call(const nb::object& to_call, const Tell& tell);
  /// `fill` makes the dict that the function is called with.
  template <typename Fill>
  void CallWithDict(const nb::object& to_call, const Fill& fill);

  WatchFunctions functions_;
};

}  // namespace deepuav::python
