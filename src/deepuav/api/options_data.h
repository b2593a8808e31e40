#pragma once

#include <memory>
#include <string>
#include <vector>

#include "deepuav/api/options.h"
#include "deepuav/assembly/settings/run_options.h"

namespace deepuav::api {

/// What was set, in order, to be set again where it is used; `checked` knows it already.
struct Options::Data {
  struct Step {
    std::string name, value;  ///< Without a name: a file of options.
  };

  void Apply(const Step& step, OptionRegistry* registry) const;

  std::vector<Step> steps;
  RunSettings checked;
};

/// The library's way to what is private.
struct Access {
  /// As the command line's: throws core's WrongUse.
  static std::unique_ptr<RunSettings> Settings(const Options& options,
                                               const std::string& best_method = "nearest");
};

}  // namespace deepuav::api
