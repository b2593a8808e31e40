#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "commands/commands.h"
#include "deepuav/assembly/settings/shipped_models.h"
#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kBytesPerMb = 1e6;
constexpr size_t kShortDigits = 12;

const char* Word(ModelState state) {
  constexpr std::array<const char*, 3> kWords = {"ok", "damaged", "missing"};
  return kWords[static_cast<size_t>(state)];
}

/// Of a network in two files, both; what is missing counts nothing.
uintmax_t Bytes(const std::filesystem::path& file) {
  std::error_code missing;
  uintmax_t total = 0;
  const std::filesystem::path weights = std::filesystem::path(file).replace_extension(".bin");
  for (const auto& part : {file, file.extension() == ".xml" ? weights : ""}) {
    const uintmax_t bytes = std::filesystem::file_size(part, missing);
    if (!missing) total += bytes;
  }
  return total;
}

std::string OrDash(const std::string& text) { return text.empty() ? "-" : text; }

constexpr char kRow[] = "{:<22} {:<10} {:<6} {:<9} {:<27} {:>6} {:<12} {:<7} {:<11} {}\n";

std::string TextRow(const ShippedModel& model, ModelState state) {
  return fmt::format(kRow, model.name, model.kind, OrDash(model.size), OrDash(model.precision),
                     model.file.filename().string(),
                     fmt::format("{:.2f}", static_cast<double>(Bytes(model.file)) / kBytesPerMb),
                     model.sha256.substr(0, kShortDigits), Word(state), model.licence,
                     model.card.string());
}

Json JsonRow(const ShippedModel& model, ModelState state) {
  return {{"name", model.name},          {"kind", model.kind},
          {"size", model.size},          {"precision", model.precision},
          {"file", model.file.string()}, {"bytes", Bytes(model.file)},
          {"sha256", model.sha256},      {"state", Word(state)},
          {"licence", model.licence},    {"card", model.card.string()}};
}

void ListModels(bool as_json) {
  const auto& models = ShippedModels().models();
  Json table = Json::array();
  std::string text = fmt::format(kRow, "name", "kind", "size", "precision", "file", "MB", "SHA-256",
                                 "state", "licence", "card");
  std::string bad;
  for (const ShippedModel& model : models) {
    const ModelState state = ModelRegistry::StateOf(model);
    table.push_back(JsonRow(model, state));
    text += TextRow(model, state);
    if (state != ModelState::kOk)
      bad += fmt::format("{}{} is {}", bad.empty() ? "" : ", ", model.name, Word(state));
  }
  std::cout << (as_json ? table.dump(2, ' ', false, Json::error_handler_t::replace) + "\n" : text)
            << std::flush;
  if (!bad.empty()) throw Error("{}", bad);
}

}  // namespace

void AddModelsCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("models", "The networks and vocabularies shipped");
  const auto as_json = std::make_shared<bool>(false);
  command->add_flag("--json", *as_json, "As JSON");
  command->footer("Status 1 where one is damaged or missing.\nExample:\n  deepuav models");
  command->callback([as_json] { ListModels(*as_json); });
}

}  // namespace deepuav
