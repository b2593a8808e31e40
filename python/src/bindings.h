#pragma once

#include <nanobind/nanobind.h>

namespace deepuav::python {

/// Cameras, maps, options, matching, evaluation.
void BindValues(nanobind::module_& module);
/// Runs and their results.
void BindSlam(nanobind::module_& module);

}  // namespace deepuav::python
