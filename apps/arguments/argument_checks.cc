#include "arguments/argument_checks.h"

#include <algorithm>
#include <system_error>

#include "deepuav/base/error.h"
#include "deepuav/base/nearest_name.h"
#include "deepuav/io/files/atomic_file.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {

namespace fs = std::filesystem;

CLI::Validator NumberThat(bool (*suits)(double), const char* expected) {
  return CLI::Validator(
      [=](const std::string& text) {
        double number = 0;
        if (IsNumber(text, &number) && suits(number)) return std::string();
        return fmt::format("{}: expected {}", Quoted(text), expected);
      },
      "");
}

CLI::Validator NumberOfFrames() {
  return NumberThat([](double number) { return number == -1 || number >= 1; },
                    "-1 or a number of at least 1");
}

CLI::Validator NamedPath() {
  return CLI::Validator(
      [](const std::string& text) {
        return text.empty() ? std::string("is empty: expected a path") : std::string();
      },
      "");
}

CLI::Validator NamedOutput() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        if (text.empty()) return "is empty: expected a path";
        if (text == "-") return "is '-': expected a path, as ./- where that is its name";
        return "";
      },
      "");
}

std::string Counted(size_t count, const std::string& what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

void ProbeOutput(const fs::path& file) {
  if (file.empty()) return;
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  // Who reads from a pipe would take the probe's end for the end of the output.
  if (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status)) return;
  const AtomicFile probe(file);
}

void RefuseInputAsOutput(const fs::path& output, const std::vector<fs::path>& inputs) {
  for (const fs::path& input : inputs) {
    std::error_code error;  // of a file that is not there: then they are not the same
    if (!output.empty() && fs::is_regular_file(output, error) &&
        fs::equivalent(output, input, error)) {
      throw Error("{}: is the input: expected another file", output.string());
    }
  }
}

std::string UnknownCommandMessage(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  std::vector<std::string> known;
  for (const CLI::App* one : command->get_subcommands({})) known.push_back(one->get_name());
  const std::vector<std::string> words = command->remaining();
  if (known.empty() || words.empty()) return "";
  const std::string what = words.front().starts_with('-') ? "argument" : "command";
  std::string names;
  for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
  return fmt::format("unknown {} {}: expected one of {}; the nearest is '{}'", what,
                     Quoted(words.front()), names, NearestName(words.front(), known));
}

}  // namespace deepuav
