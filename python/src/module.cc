#include "bindings.h"
#include "deepuav/api/options.h"
#include "deepuav/api/types.h"

#include <nanobind/stl/string.h>

namespace nb = nanobind;

NB_MODULE(_deepuav, module) {
  nb::exception<deepuav::api::Error>(module, "Error", PyExc_RuntimeError);
  module.def("version", &deepuav::api::Version, "The version of the library.");
  module.def("log_to_stderr", &deepuav::api::LogToStderr, nb::arg("level"),
             "Logs to stderr from this level on: trace, debug, info, warn, error or off. Not while "
             "a run goes on.");
  deepuav::python::BindValues(module);
  deepuav::python::BindSlam(module);
}
