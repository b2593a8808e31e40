#include "deepuav/inference/network_file.h"

#include <algorithm>
#include <openvino/frontend/manager.hpp>
#include <openvino/op/constant.hpp>
#include <span>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/base/input_file.h"
#include "deepuav/base/sha256.h"
#include "deepuav/inference/session.h"

namespace deepuav {
namespace {

std::filesystem::path WeightsOf(std::filesystem::path xml) { return xml.replace_extension(".bin"); }

void CheckIsFile(const std::filesystem::path& file) {
  RefuseNamedPipe(file);
  std::error_code status;
  if (!std::filesystem::is_regular_file(file, status)) {
    throw Error("{}: no such file: expected a network (.onnx, or OpenVINO's .xml and .bin)",
                file.string());
  }
}

// Names the file that the user gave, too.
void CheckHasWeights(const std::filesystem::path& xml) {
  std::error_code status;
  if (!std::filesystem::is_regular_file(WeightsOf(xml), status)) {
    throw Error("{}: has no weights: expected its {} beside it", xml.string(),
                WeightsOf(xml).filename().string());
  }
}

// Asked first, as the runtime tries its readers of other formats on a file that is no ONNX, and
// those complain on stderr.
bool LooksLikeOnnx(const std::filesystem::path& model) {
  const auto reader = ov::frontend::FrontEndManager().load_by_framework("onnx");
  return reader && reader->supported(model.string());
}

}  // namespace

ov::Core& Core() {
  static ov::Core core;
  return core;
}

std::string LastLine(const std::string& message) {
  const size_t end = message.find_last_not_of(" \n");
  if (end == std::string::npos) return "no reason given";
  const size_t before = message.find_last_of('\n', end);
  const size_t begin = before == std::string::npos ? 0 : before + 1;
  return message.substr(begin, end + 1 - begin);
}

std::shared_ptr<ov::Model> ReadModel(const std::filesystem::path& model) {
  CheckIsFile(model);
  if (model.extension() == ".xml") {
    CheckHasWeights(model);
  } else if (!LooksLikeOnnx(model)) {
    throw Error("{}: no network that can be read: expected ONNX, or OpenVINO's .xml",
                model.string());
  }
  try {
    return Core().read_model(model.string());
  } catch (const std::exception&
               exception) {  // Readers of broken files throw other than ov::Exception, too.
    throw Error("{}: no network that can be read (ONNX, or OpenVINO's .xml): {}", model.string(),
                LastLine(exception.what()));
  }
}

bool IsQuantised(const ov::Model& model) {
  const auto operations = model.get_ops();
  return std::any_of(operations.begin(), operations.end(), [](const auto& operation) {
    return std::string_view(operation->get_type_name()) == "FakeQuantize";
  });
}

std::string ModelSha256(const std::filesystem::path& model) {
  CheckIsFile(model);
  if (model.extension() == ".xml") {
    CheckHasWeights(model);
    return Sha256OfFiles({model, WeightsOf(model)});
  }
  return Sha256OfFiles({model});
}

std::string WeightsSha256(const ov::Model& model) {
  std::string digests;
  for (const auto& node : model.get_ordered_ops()) {
    const auto constant = ov::as_type_ptr<ov::op::v0::Constant>(node);
    if (!constant) continue;
    digests += Sha256(std::span(static_cast<const std::byte*>(constant->get_data_ptr()),
                                constant->get_byte_size()));
  }
  return Sha256(digests);
}

}  // namespace deepuav
