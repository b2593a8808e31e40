#include "arguments/help_documents.h"

#include <fmt/format.h>

#include <functional>
#include <iostream>
#include <memory>
#include <vector>

namespace deepuav {
namespace {

constexpr const char* kBash = "bash";

/// Visits the program and all its commands with their full names, as "deepuav map info".
void VisitCommands(const CLI::App& app, const std::string& name,
                   const std::function<void(const CLI::App&, const std::string&)>& visit) {
  visit(app, name);
  for (const CLI::App* command : app.get_subcommands({}))
    VisitCommands(*command, name + " " + command->get_name(), visit);
}

std::vector<std::string> FlagNames(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

/// The values that an option is checked against, as CLI11 shows them: "TEXT:{a,b}".
std::string ValuesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const size_t begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return "";
  std::string values = type.substr(begin + 1, end - begin - 1);
  for (char& c : values) c = c == ',' ? ' ' : c;
  return values;
}

std::string Replaced(std::string text, const std::string& what, const std::string& with) {
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
  return text;
}

/// As text of roff: no escapes, requests or typographic hyphens in it.
std::string Roff(const std::string& text) {
  std::string escaped = Replaced(Replaced(text, "\\", "\\e"), "-", "\\-");
  escaped = Replaced(Replaced(escaped, "\n.", "\n\\&."), "\n'", "\n\\&'");
  return escaped.starts_with('.') || escaped.starts_with('\'') ? "\\&" + escaped : escaped;
}

std::string RoffOption(const CLI::Option& option) {
  std::string head = fmt::format("{}", fmt::join(FlagNames(option), ", "));
  if (head.empty()) head = option.get_name(true);
  if (!option.get_type_name().empty()) head += " " + option.get_type_name();
  if (!option.get_default_str().empty()) head += " (" + option.get_default_str() + ")";
  if (option.get_required()) head += " (required)";
  return fmt::format(".TP\n.B {}\n{}\n", Roff(head), Roff(option.get_description()));
}

std::string RoffCommand(const CLI::App& command, const std::string& name) {
  std::string text = fmt::format(".SS {}\n{}\n", Roff(name), Roff(command.get_description()));
  for (const CLI::Option* option : command.get_options({})) text += RoffOption(*option);
  if (const std::string footer = command.get_footer(); !footer.empty())
    text += fmt::format(".PP\n.nf\n{}\n.fi\n", Roff(footer));
  return text;
}

/// What a script needs to know, as the branches of `case` in the words of both shells.
struct CompletionTables {
  std::string commands;                      ///< Full names of commands.
  std::vector<std::string> options, values;  ///< Branches: of a command; of an option.
};

CompletionTables TablesOf(const CLI::App& app) {
  CompletionTables tables;
  VisitCommands(app, app.get_name(), [&](const CLI::App& command, const std::string& name) {
    std::string words;
    for (const CLI::App* sub : command.get_subcommands({})) {
      words += " " + sub->get_name();
      tables.commands +=
          fmt::format("{}\"{} {}\"", tables.commands.empty() ? "" : "|", name, sub->get_name());
    }
    for (const CLI::Option* option : command.get_options({})) {
      for (const std::string& flag : FlagNames(*option)) {
        words += " " + flag;
        const std::string values = ValuesOf(*option);
        if (!values.empty())
          tables.values.push_back(
              fmt::format("    \"{} {}\") choices=\"{}\";;", name, flag, values));
      }
    }
    tables.options.push_back(fmt::format("    \"{}\") choices=\"{}\";;", name, words.substr(1)));
  });
  return tables;
}

constexpr const char* kBashScript = R"(# Completion of deepuav for bash.
_deepuav() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} command=deepuav word choices=
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case "$command $word" in
    {commands}) command="$command $word";;
    esac
  done
  case "$command $before" in
{values}
    *) case "$command" in
{options}
    esac;;
  esac
  COMPREPLY=($(compgen -W "$choices" -- "$current"))
}}
complete -o default -F _deepuav deepuav
)";

constexpr const char* kZshScript = R"(#compdef deepuav
# Completion of deepuav for zsh.
local current=${{words[CURRENT]}} before=${{words[CURRENT-1]}} command=deepuav word choices=
for word in ${{words[2,CURRENT-1]}}; do
  case "$command $word" in
    {commands}) command="$command $word";;
  esac
done
case "$command $before" in
{values}
  *) case "$command" in
{options}
  esac;;
esac
compadd -- ${{=choices}}
[[ $current == -* ]] || _files
)";

}  // namespace

std::string ManualPage(const CLI::App& app, const std::string& version) {
  std::string text = fmt::format(
      ".TH DEEPUAV 1 \"\" \"deepuav {}\" \"User commands\"\n.SH NAME\ndeepuav \\- {}\n"
      ".SH SYNOPSIS\n.B deepuav\n.I command\n[arguments]\n.SH COMMANDS\n",
      version, Roff(app.get_description()));
  VisitCommands(app, app.get_name(), [&](const CLI::App& command, const std::string& name) {
    if (&command != &app) text += RoffCommand(command, name);
  });
  return text +
         ".SH EXIT STATUS\n0 on success, 1 on failure, 2 on wrong use, 128 and the signal's number "
         "after one.\n";
}

std::string CompletionScript(const CLI::App& app, const std::string& shell) {
  const CompletionTables tables = TablesOf(app);
  return fmt::format(fmt::runtime(shell == kBash ? kBashScript : kZshScript),
                     fmt::arg("commands", tables.commands),
                     fmt::arg("values", fmt::to_string(fmt::join(tables.values, "\n"))),
                     fmt::arg("options", fmt::to_string(fmt::join(tables.options, "\n"))));
}

void AddHelpDocumentCommands(CLI::App& app) {
  CLI::App* manual = app.add_subcommand("manual", "Print the manual page");
  manual->footer("Example:\n  deepuav manual | man -l -");
  manual->callback([&app] { std::cout << ManualPage(app, DEEPUAV_VERSION); });

  CLI::App* completion = app.add_subcommand("completion", "Print the completion script of a shell");
  const auto shell = std::make_shared<std::string>();
  completion->add_option("SHELL", *shell, "bash or zsh")
      ->required()
      ->check(CLI::IsMember({kBash, "zsh"}));
  completion->footer("Example:\n  source <(deepuav completion bash)");
  completion->callback([&app, shell] { std::cout << CompletionScript(app, *shell); });
}

}  // namespace deepuav
