#include "work/network_bench.h"

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "deepuav/base/random.h"
#include "deepuav/base/time.h"

namespace deepuav {
namespace {

constexpr int64_t kCellPx = 8;
constexpr int kWarmUpRuns = 3, kFewestRuns = 10;

int64_t RoundUpToCells(int pixels) { return (pixels + kCellPx - 1) / kCellPx * kCellPx; }

TensorShape ShapeFor(const TensorInfo& input, const NetworkBenchOptions& options) {
  const bool is_image = input.shape.size() == 4;
  const TensorShape wanted = is_image ? TensorShape{1, 1, RoundUpToCells(options.height_px),
                                                    RoundUpToCells(options.width_px)}
                                      : TensorShape{1, options.points};
  TensorShape shape = input.shape;
  for (size_t i = 0; i < shape.size(); ++i) {
    if (shape[i] == kAnySize) shape[i] = wanted[std::min(i, wanted.size() - 1)];
  }
  return shape;
}

/// The maps that the program reads cell by cell: descriptors and the detector's logits.
std::set<std::string> ChannelsLastOutputs(const Session& session) {
  std::set<std::string> names;
  for (const TensorInfo& output : session.outputs()) {
    if (output.shape.size() != 4) continue;
    const bool is_logits = output.shape[1] == kCellPx * kCellPx + 1;
    if (is_logits || output.name.find("desc") != std::string::npos) names.insert(output.name);
  }
  return names;
}

using InputValues = std::map<std::string, std::vector<float>>;

InputValues RandomInputs(const Session& session) {
  Random random(1);
  InputValues values;
  for (const TensorInfo& input : session.inputs()) {
    int64_t count = 1;
    for (const int64_t size : input.shape) count *= size;
    std::vector<float>& tensor = values[input.name];
    for (int64_t i = 0; i < count; ++i) tensor.push_back(static_cast<float>(random.Uniform(0, 1)));
  }
  return values;
}

double Quantile(const std::vector<double>& sorted, double quantile) {
  return sorted[static_cast<size_t>(quantile * static_cast<double>(sorted.size() - 1) + 0.5)];
}

std::vector<double> TimeRuns(Session* session, double seconds) {
  for (int run = 0; run < kWarmUpRuns; ++run) session->Run();
  std::vector<double> times_ms;
  const Stopwatch total;
  while (total.Seconds() < seconds || times_ms.size() < kFewestRuns) {
    const Stopwatch one;
    session->Run();
    times_ms.push_back(1e3 * one.Seconds());
  }
  return times_ms;
}

}  // namespace

bool IsQuantisedNetwork(const std::filesystem::path& model) {
  return Session(model, {}).precision().starts_with("int8");
}

NetworkTiming TimeNetwork(const std::filesystem::path& model, const InferenceOptions& inference,
                          const NetworkBenchOptions& options) {
  Session session(model, inference);
  std::map<std::string, TensorShape> shapes;
  for (const TensorInfo& input : session.inputs()) shapes[input.name] = ShapeFor(input, options);
  session.Reshape(shapes);
  session.Compile(ChannelsLastOutputs(session));
  const InputValues values = RandomInputs(session);
  for (const auto& [name, tensor] : values) session.SetInput(name, tensor);
  std::vector<double> times_ms = TimeRuns(&session, options.seconds);
  std::sort(times_ms.begin(), times_ms.end());
  return {session.precision(),     session.threads(),       Quantile(times_ms, 0.5),
          Quantile(times_ms, 0.1), Quantile(times_ms, 0.9), static_cast<int>(times_ms.size())};
}

}  // namespace deepuav
