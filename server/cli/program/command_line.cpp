// A thin skin over CLI11, a line or two a call; its objects belong to the program's.

#include "server/cli/program/command_line.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <type_traits>

#include "server/log/printable.h"

namespace tind::cli {

namespace {

/// What is wrong with a number that `fits` refuses; words, and what is not finite, are for
/// add_option's check.
std::string wrong_unless(const std::string& text, const char* must, bool (*fits)(double)) {
  double value = 0;
  if (!CLI::detail::lexical_cast(text, value)) return {};
  return !std::isfinite(value) || fits(value) ? std::string() : must + (", not " + text);
}

/// What T is made of, one by one.
template <class T>
struct Element {
  using Type = T;
};
template <class T>
struct Element<std::optional<T>> {
  using Type = T;
};
template <class T>
struct Element<std::vector<T>> {
  using Type = T;
};

/// CLI11 takes -5 for 2^64 - 5, and says "could not convert" of what is no number.
template <class Number>
std::string wrong_number(const std::string& text) {
  const bool whole = std::is_integral_v<Number>;
  if (std::is_unsigned_v<Number> && text.starts_with('-')) return "must be 0 or more, not " + text;
  Number value{};
  if (CLI::detail::lexical_cast(text, value)) {
    if (whole || std::isfinite(double(value))) return {};
    return "must be a finite number, not " + text;  // in no range, and in every one for comparisons
  }
  double share = 0;
  if (!whole && text.ends_with('%') &&
      CLI::detail::lexical_cast(text.substr(0, text.size() - 1), share))
    return "'" + text + "' is not a number; write " + text + " as " +
           CLI::detail::to_string(share / 100);
  return "'" + text + "' is not a " + (whole ? "whole number, or too large" : "number");
}

}  // namespace

// --- options -------------------------------------------------------------------------------------

Option Option::required() {
  option_->required();
  return *this;
}

Option Option::shown() {
  option_->capture_default_str();
  return *this;
}

Option Option::one_of(std::vector<std::string> words) {
  option_->transform(CLI::IsMember(std::move(words), CLI::ignore_case));
  return *this;
}

Option Option::in_lower_case() {
  option_->transform([](const std::string& text) { return CLI::detail::to_lower(text); }, "");
  return *this;
}

Option Option::positive() {
  option_->check(
      [](const std::string& text) {
        return wrong_unless(text, "must be above 0", [](double v) { return v > 0; });
      },
      "POSITIVE");
  return *this;
}

Option Option::not_negative() {
  option_->check(
      [](const std::string& text) {
        return wrong_unless(text, "must be 0 or more", [](double v) { return v >= 0; });
      },
      "NONNEGATIVE");
  return *this;
}

Option Option::range(double low, double high) {
  option_->check(CLI::Range(low, high));
  return *this;
}

Option Option::range(std::int64_t low, std::int64_t high) {
  option_->check(CLI::Range(low, high));
  return *this;
}

Option Option::bytes() {
  option_->transform(CLI::AsSizeValue(false));
  option_->transform(CLI::Validator(  // the last one runs first
      [](std::string& text) -> std::string {
        if (text.starts_with('-')) return "must be 0 or more, not " + text;
        std::uint64_t number = 0;  // what is no number at all, AsSizeValue says
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        if (error == std::errc::result_out_of_range) return text + " is beyond all memory";
        return {};
      },
      ""));
  return *this;
}

Option Option::delimiter(char separator) {
  option_->delimiter(separator);
  return *this;
}

Option Option::expected(int values) {
  option_->expected(values);
  return *this;
}

Option Option::repeated() {
  option_->allow_extra_args(false);
  return *this;
}

Option Option::needs(Option other) {
  option_->needs(other.option_);
  return *this;
}

Option Option::check(std::function<std::string(const std::string&)> wrong) {
  option_->check(std::move(wrong));
  return *this;
}

// --- commands ------------------------------------------------------------------------------------

template <class T>
Option Command::add_option(const std::string& name, T& value, const std::string& help) {
  CLI::Option* const option = app_->add_option(name, value, help);
  using Number = typename Element<T>::Type;
  if constexpr (std::is_arithmetic_v<Number>) option->check(wrong_number<Number>);
  return Option(option);
}

template Option Command::add_option(const std::string&, std::string&, const std::string&);
template Option Command::add_option(const std::string&, int&, const std::string&);
template Option Command::add_option(const std::string&, std::uint32_t&, const std::string&);
template Option Command::add_option(const std::string&, std::int64_t&, const std::string&);
template Option Command::add_option(const std::string&, std::uint64_t&, const std::string&);
template Option Command::add_option(const std::string&, double&, const std::string&);
template Option Command::add_option(const std::string&, std::vector<std::string>&,
                                    const std::string&);
template Option Command::add_option(const std::string&, std::vector<double>&, const std::string&);
template Option Command::add_option(const std::string&, std::optional<std::string>&,
                                    const std::string&);
template Option Command::add_option(const std::string&, std::optional<double>&, const std::string&);
template Option Command::add_option(const std::string&, std::optional<std::uint64_t>&,
                                    const std::string&);

Option Command::add_words(const std::string& name, std::vector<std::string> words, std::string now,
                          const std::function<void(const std::string&)>& take,
                          const std::string& help) {
  CLI::Option* const option = app_->add_option_function<std::string>(name, take, help);
  option->default_function([now = std::move(now)] { return now; });
  return Option(option).one_of(std::move(words));
}

Option Command::add_flag(const std::string& name, bool& value, const std::string& help) {
  return Option(app_->add_flag(name, value, help));
}

Option Command::add_function(const std::string& name,
                             const std::function<void(const std::string&)>& take,
                             const std::string& help) {
  return Option(app_->add_option_function<std::string>(name, take, help));
}

Option Command::add_switch(const std::string& name, std::function<void(const std::string&)> take,
                           const std::string& help) {
  const auto value = std::make_shared<std::string>();
  CLI::Option* const option = app_->add_flag(name, *value, help);
  option->each([take = std::move(take), value](const std::string& given) { take(given); });
  return Option(option);
}

Command Command::add_group(const std::string& title, int least, int most) {
  CLI::Option_group* const group = app_->add_option_group(title);
  group->require_option(std::size_t(least), std::size_t(most));
  return Command(group, environment_);
}

Command Command::add_subcommand(const std::string& name, const std::string& what) {
  return Command(app_->add_subcommand(name, what), environment_);
}

void Command::footer(const std::string& text) { app_->footer(text); }

void Command::on_run(std::function<void()> run) { app_->callback(std::move(run)); }

bool Command::given(const std::string& option) const {
  const CLI::Option* const found = app_->get_option_no_throw(option);
  return found && found->count() > 0;
}

std::vector<std::string> Command::subcommands() const {
  std::vector<std::string> names;
  for (const CLI::App* command : app_->get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

void refuse_missing(const std::string& name) { throw CLI::RequiredError(name); }

void refuse_value(const std::string& name, const std::string& why) {
  throw CLI::ValidationError(name, why);
}

// --- the line ------------------------------------------------------------------------------------

Program::Program(const std::string& description, const std::string& version,
                 std::shared_ptr<const Environment> environment)
    : app_(std::make_unique<CLI::App>(description)), environment_(std::move(environment)) {
  app_->set_version_flag("--version", version);
  app_->failure_message([](const CLI::App*, const CLI::Error& e) {
    return logging::printable(e.what()) + "\nRun with --help for more information.\n";
  });
  app_->require_subcommand(1);
}

Program::~Program() = default;

Program::Parsed Program::parse(int argc, const char* const* argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    std::ostringstream help, errors;
    const bool good = app_->exit(e, help, errors) == 0;
    std::fputs(help.str().c_str(), stdout);
    return {.ran = false, .good = good, .errors = good ? "" : "tind: " + errors.str()};
  }
  return {.ran = true, .good = true, .errors = {}};
}

}  // namespace tind::cli
