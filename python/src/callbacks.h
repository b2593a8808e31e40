#pragma once

#include <nanobind/nanobind.h>

#include <string>

#include "deepuav/api/observer.h"

namespace deepuav::python {

namespace nb = nanobind;

std::string NameOf(api::FrameState state);

/// Hands events to functions of Python; None: nothing is told. What they raise is printed as other
/// exceptions that nobody can catch.
class Callbacks : public api::Observer {
 public:
  Callbacks(nb::object on_frame, nb::object on_keyframe, nb::object on_map);
  Callbacks(const Callbacks&) = delete;
  Callbacks& operator=(const Callbacks&) = delete;
  ~Callbacks() override;

  void OnFrame(const api::FrameEvent& event) override;
  void OnKeyframe(const api::KeyframeEvent& event) override;
  void OnMap(const api::MapEvent& event) override;

  /// For the interpreter's search for circles of objects.
  int Visit(visitproc visit, void* arg) const;
  /// Nothing is told from now on.
  void Clear();

 private:
  template <typename Fill>
  void Call(const nb::object& to_call, const Fill& fill);

  nb::object on_frame_, on_keyframe_, on_map_;
};

}  // namespace deepuav::python
