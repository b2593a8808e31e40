#pragma once

#include <memory>
#include <string>
#include <vector>

#include "deepuav/api/types.h"

namespace deepuav::api {

/// One option as it stands.
struct OptionValue {
  std::string name, value, unit, meaning;
};

/// The options of a run, under the names and with the values of the command line's --set and
/// --config: "features.keypoints", "800". Copies are independent. Thread-compatible.
class DEEPUAV_API Options {
 public:
  Options();
  Options(const Options& other);
  Options& operator=(const Options& other);
  ~Options();

  /// Throws Error for an unknown name, naming the nearest known one, and for a value that is none
  /// of the option's type. Whether values go together is checked where the options are used.
  void Set(const std::string& name, const std::string& value);
  /// Sets what a YAML file of options says, which is read again where the options are copied or
  /// used. Throws Error naming file, line and option.
  void Load(const std::string& file);
  /// All options, by name.
  std::vector<OptionValue> List() const;

 private:
  friend struct Access;
  struct Data;
  std::unique_ptr<Data> data_;
};

/// The version of the library.
DEEPUAV_API std::string Version();

/// The library is silent until this says from which level on it logs to stderr: trace, debug, info,
/// warn, error or off. Throws Error for another name. Not while anything of the library runs.
DEEPUAV_API void LogToStderr(const std::string& level);

}  // namespace deepuav::api
