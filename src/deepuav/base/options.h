#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "deepuav/base/option_check.h"

namespace deepuav {

/// One settable value of an options struct.
struct OptionEntry {
  std::string unit;     ///< "px", "m", "s", "" for counts and ratios.
  std::string meaning;  ///< One line.
  std::string bounds;   ///< "1 to 50", "road or river"; "" for a switch and for any text.
  std::function<void(const std::string& text)> set;
  std::function<std::string()> get;
};

/// The settable values of a program by dotted name ("tracking.keypoints"). Options structs list
/// their members in `template <typename Visitor> void Visit(Visitor&& visit)`, calling `visit(name,
/// member, unit, meaning, bounds)` for each number, the same for texts, of which bounds may be left
/// out, `visit(name, member, unit, meaning)` for switches, and `visit.Part(name, member)` for
/// structs of options, whose values are named under that name. CheckOptions() holds the values
/// against these bounds; to set one is not to check it, as another may follow. The registry refers
/// to the structs, which must outlive it. Not thread-safe.
class OptionRegistry {
 public:
  /// Adds the members of `options` under `prefix`.
  template <typename Options>
  void Add(const std::string& prefix, Options* options) {
    options->Visit(Adder(this, prefix));
  }

  /// Sets one value from its text. Throws Error for an unknown name (naming the nearest known one)
  /// and for a text that is no value of the option's type.
  void Set(const std::string& name, const std::string& text);

  /// Sets from "name=value", as given to --set.
  void SetAssignment(const std::string& assignment);

  const std::map<std::string, OptionEntry>& entries() const { return entries_; }

 private:
  class Adder {
   public:
    Adder(OptionRegistry* registry, std::string prefix)
        : registry_(registry), prefix_(std::move(prefix)) {}

    template <typename Value, typename... Bounds>
    void operator()(const std::string& name, Value& value, const std::string& unit,
                    const std::string& meaning, const Bounds&... bounds) const {
      registry_->AddValue(JoinOptionName(prefix_, name), &value, {unit, meaning, "", {}, {}},
                          bounds...);
    }
    template <typename Options>
    void Part(const std::string& name, Options& part) const {
      registry_->Add(JoinOptionName(prefix_, name), &part);
    }

   private:
    OptionRegistry* registry_;
    std::string prefix_;
  };

  void AddValue(const std::string& name, bool* value, OptionEntry entry);
  void AddValue(const std::string& name, int* value, OptionEntry entry, const NumberBounds& bounds);
  void AddValue(const std::string& name, double* value, OptionEntry entry,
                const NumberBounds& bounds);
  void AddValue(const std::string& name, std::string* value, OptionEntry entry,
                const TextBounds& bounds = AnyText());

  std::map<std::string, OptionEntry> entries_;
};

}  // namespace deepuav
