#include "server/cli/options/method_options.h"

#include <algorithm>
#include <array>
#include <concepts>
#include <map>
#include <memory>
#include <sstream>
#include <type_traits>

#include "terrain/base/result.h"

namespace tind::cli {

namespace {

// How each kind of field becomes an option of the line.

template <NamedEnum E>
void add_field(Command app, const std::string& name, E& field, const char* help) {
  app.add_choice(name, field, help).shown();
}
void add_field(Command app, const std::string& name, bool& field, const char* help) {
  app.add_flag(name, field, help);
}
template <class Number>
requires std::same_as<Number, int> || std::same_as<Number, double>
void add_field(Command app, const std::string& name, Number& field, const char* help) {
  app.add_option(name, field, help).shown();
}
/// Colours of posts: the command reads them of an image.
void add_field(Command, const std::string&,
               const std::shared_ptr<const std::vector<std::array<float, 3>>>&, const char*) {}

/// Options that several methods have under one name, with the help of all: each reads its own
/// words.
std::map<std::string, std::string> shared_options() {
  std::map<std::string, std::string> once, shared;
  for (const MethodOptions& method : all_methods()) {
    std::visit(
        [&](const auto& options) {
          options.each_option([&](const std::string& name, auto member, const char* help) {
            std::string text = help;
            if constexpr (NamedEnum<std::remove_cvref_t<decltype(options.*member)>>) {
              std::string words;
              for (const auto& word : enum_names<std::remove_cvref_t<decltype(options.*member)>>())
                words += (words.empty() ? "" : ", ") + word;
              text += " (" + words + "; default " + name_of(options.*member) + ")";
            }
            const auto [first, is_new] = once.try_emplace(name, text);
            if (is_new) return;
            const auto known = shared.try_emplace(name, first->second).first;
            known->second += "; " + text;
          });
        },
        method);
  }
  return shared;
}

/// Of a shared option, where the method has it.
Result<void> set_word(MethodOptions& method, const std::string& name, const std::string& word) {
  Result<void> done;
  std::visit(
      [&](auto& options) {
        options.each_option([&](const std::string& known, auto member, const char*) {
          using Field = std::remove_cvref_t<decltype(options.*member)>;
          if constexpr (NamedEnum<Field>) {
            if (known != name) return;
            const auto value = parse_enum<Field>(word);
            if (value)
              options.*member = *value;
            else
              done = std::unexpected(value.error());
          }
        });
      },
      method);
  return done;
}

/// "edge-cost alpha=0.5" is how settings and records say it.
Result<MethodOptions> method_named_alone(const std::string& name) {
  auto named = method_named(name);
  const std::size_t blank = name.find(' ');
  if (named || blank == name.npos || !method_named(name.substr(0, blank))) return named;
  std::string hint = "--method " + name.substr(0, blank);
  std::istringstream words(name.substr(blank));
  for (std::string word; words >> word;) {
    if (const auto equals = word.find('='); equals != word.npos) word[equals] = ' ';
    hint += " --" + word;
  }
  return fail(Errc::invalid_argument,
              "a method's options are options of their own on a command line: " + hint);
}

}  // namespace

Result<MethodOptions> method_of(Command app, const MethodLine& line,
                                std::initializer_list<std::string_view> without) {
  const Result<MethodOptions> named = method_named_alone(line.name);
  if (!named) return named;
  const auto all = methods();
  const auto chosen = std::ranges::find(all, line.name, &MethodInfo::name);
  for (const MethodInfo& other : all) {
    for (const std::string& name : other.options) {
      if (!app.given("--" + name) || std::ranges::count(chosen->options, name) ||
          std::ranges::count(without, name))
        continue;
      std::string owners;
      for (const MethodInfo& owner : all)
        if (std::ranges::count(owner.options, name))
          owners += (owners.empty() ? "" : " or ") + owner.name;
      return fail(Errc::invalid_argument, "--" + name + " is for " + owners + ", not for " +
                                              line.name + ": leave it out, or choose --method " +
                                              owners);
    }
  }
  MethodOptions method = *std::ranges::find(line.all, named->index(), &MethodOptions::index);
  for (const auto& [name, word] : line.shared)
    if (const auto ok = set_word(method, name, word); !ok) return std::unexpected(ok.error());
  return method;
}

void add_method_choice(Command app, MethodLine& line,
                       std::initializer_list<std::string_view> without) {
  app.add_option("--method", line.name, "how; 'tind methods' says which to take for what")
      .in_lower_case()
      .shown();
  const auto shared = shared_options();
  for (MethodOptions& method : line.all) {
    std::visit(
        [&](auto& options) {
          options.each_option([&](const std::string& name, auto member, const char* help) {
            if (std::ranges::count(without, name) == 0 && !shared.contains(name))
              add_field(app, "--" + name, options.*member, help);
          });
        },
        method);
  }
  for (const auto& [name, help] : shared) {
    if (std::ranges::count(without, name) > 0) continue;
    const auto take = [&line, key = name](const std::string& word) { line.shared[key] = word; };
    app.add_function("--" + name, take, help);
  }
}

void add_method_options(Command app, MethodLine& line, int& threads,
                        std::initializer_list<std::string_view> without) {
  add_method_choice(app, line, without);
  app.add_option("--threads", threads, "threads to use, 0: one per core").not_negative().shown();
}

}  // namespace tind::cli
