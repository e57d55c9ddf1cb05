#include "terrain/simplify/method_text.h"

#include <fmt/format.h>

#include <charconv>
#include <sstream>

#include "terrain/simplify/methods.h"

namespace tind {

namespace {

constexpr const char *kOn = "on", *kOff = "off";

using Drape = std::shared_ptr<const std::vector<std::array<float, 3>>>;

// How each kind of field is written: nothing where text cannot say it.

template <NamedEnum E>
std::string text_of(E value) {
  return name_of(value);
}
std::string text_of(bool value) { return value ? kOn : kOff; }
std::string text_of(int value) { return std::to_string(value); }
std::string text_of(double value) { return fmt::format("{}", value); }  // reads back as it was
std::string text_of(const Drape&) { return {}; }

// And how it is read.

template <NamedEnum E>
Result<void> read(const std::string& text, E& value) {
  const auto parsed = parse_enum<E>(text);
  if (!parsed) return std::unexpected(parsed.error());
  value = *parsed;
  return {};
}
Result<void> read(const std::string& text, bool& value) {
  if (text != kOn && text != kOff)
    return fail(Errc::invalid_argument, "'" + text + "' is neither on nor off");
  value = text == kOn;
  return {};
}
template <class Number>
Result<void> read_number(const std::string& text, Number& value) {
  const char* const end = text.data() + text.size();
  const auto [after, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || after != end)
    return fail(Errc::invalid_argument, "'" + text + "' is not a number");
  return {};
}
Result<void> read(const std::string& text, int& value) { return read_number(text, value); }
Result<void> read(const std::string& text, double& value) { return read_number(text, value); }
Result<void> read(const std::string&, Drape&) {
  return fail(Errc::invalid_argument, "an image cannot be given here");
}

/// Sets one "name=value".
template <class Options>
Result<void> set_option(Options& options, const std::string& word) {
  const std::size_t equals = word.find('=');
  const std::string name = word.substr(0, equals);
  Result<void> done =
      fail(Errc::invalid_argument, std::string(Options::kName) + " has no option '" + name + "'");
  std::string names;
  Options::each_option([&](const std::string& known, auto member, const char*) {
    names += (names.empty() ? "" : ", ") + known;
    if (known != name) return;
    done = equals == std::string::npos
               ? fail(Errc::invalid_argument, "'" + name + "' lacks its value: " + name + "=...")
               : read(word.substr(equals + 1), options.*member);
  });
  if (done) return {};
  return std::unexpected(
      Error{done.error().code, fmt::format("option '{}': {} ({})", word, done.error().what,
                                           names.empty() ? "it has none" : "it has " + names)});
}

}  // namespace

std::string method_text(const MethodOptions& method) {
  return std::visit(
      [](const auto& options) {
        using Options = std::remove_cvref_t<decltype(options)>;
        std::string text = Options::kName;
        Options::each_option([&](const std::string& name, auto member, const char*) {
          const std::string value = text_of(options.*member);
          if (value != text_of(Options{}.*member)) text += " " + name + "=" + value;
        });
        return text;
      },
      method);
}

Result<MethodOptions> method_from_text(const std::string& text) {
  std::istringstream words(text);
  std::string word;
  words >> word;
  Result<MethodOptions> method = method_named(word);
  if (!method) return method;
  while (words >> word) {
    const auto set = std::visit([&](auto& options) { return set_option(options, word); }, *method);
    if (!set) return std::unexpected(set.error());
  }
  if (const auto ok = check_options(*method); !ok) return std::unexpected(ok.error());
  return method;
}

}  // namespace tind
