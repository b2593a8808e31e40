#include "deepuav/api/options.h"

#include "deepuav/api/guarded.h"
#include "deepuav/api/options_data.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/files/options_file.h"

namespace deepuav::api {

void Options::Data::Apply(const Step& step, OptionRegistry* registry) const {
  if (step.name.empty()) return LoadOptionsFile(step.value, registry);
  registry->Set(step.name, step.value);
}

Options::Options() : data_(Guarded([] { return std::make_unique<Data>(); })) {}

Options::Options(const Options& other) : Options() { *this = other; }

Options& Options::operator=(const Options& other) {
  if (this == &other) return *this;
  data_ = Guarded([&] {
    auto data = std::make_unique<Data>();
    data->steps = other.data_->steps;
    for (const Data::Step& step : data->steps) data->Apply(step, &data->checked.registry);
    return data;
  });
  return *this;
}

Options::~Options() = default;

void Options::Set(const std::string& name, const std::string& value) {
  Guarded([&] {
    data_->checked.registry.Set(name, value);
    data_->steps.push_back({name, value});
  });
}

void Options::Load(const std::string& file) {
  Guarded([&] {
    LoadOptionsFile(file, &data_->checked.registry);
    data_->steps.push_back({"", file});
  });
}

std::vector<OptionValue> Options::List() const {
  return Guarded([&] {
    std::vector<OptionValue> values;
    for (const auto& [name, entry] : data_->checked.registry.entries())
      values.push_back({name, entry.get(), entry.unit, entry.meaning});
    return values;
  });
}

std::unique_ptr<RunSettings> Access::Settings(const Options& options,
                                              const std::string& best_method) {
  return ReadSettings(
      [&](OptionRegistry* registry) {
        for (const auto& step : options.data_->steps) options.data_->Apply(step, registry);
      },
      best_method);
}

std::string Version() { return DEEPUAV_VERSION; }

void LogToStderr(const std::string& level) {
  Guarded([&] { ::deepuav::LogToStderr(level); });
}

}  // namespace deepuav::api
