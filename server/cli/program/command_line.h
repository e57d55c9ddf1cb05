#pragma once
// The command line as subcommands see it. CLI11 stays in command_line.cpp: reading its headers and
// instantiating its templates took most of the time of compiling a command.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "terrain/base/enum_names.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace tind {
class Environment;
}

namespace tind::cli {

/// An option or a positional of a command: a handle, copied freely. Each call says more of it.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option required();
  Option shown();  // help says the default
  Option one_of(std::vector<std::string> words);
  Option in_lower_case();  // of words: in any case
  Option positive();       // a number above 0
  Option not_negative();   // 0 or above
  Option range(double low, double high);
  Option range(std::int64_t low, std::int64_t high);
  Option range(int low, int high) { return range(std::int64_t(low), std::int64_t(high)); }
  Option bytes();                    // "400M", "2G": powers of 1024
  Option delimiter(char separator);  // of lists
  Option expected(int values);
  Option repeated();  // of lists: one value each time it is given
  Option needs(Option other);
  /// `wrong`: what is wrong with a value; empty where nothing is.
  Option check(std::function<std::string(const std::string&)> wrong);

 private:
  CLI::Option* option_;
};

/// A command, or a group of its options: a handle, copied freely.
class Command {
 public:
  Command(CLI::App* app, std::shared_ptr<const Environment> environment)
      : app_(app), environment_(std::move(environment)) {}

  /// `name` is "--name", "-n,--name", or "name" for a positional. The value is written when the
  /// line is parsed, so it lives as long as the program. T: std::string, int, std::uint32_t,
  /// std::int64_t, std::uint64_t, double; std::vector of strings or doubles; std::optional of
  /// string, double or std::uint64_t.
  template <class T>
  Option add_option(const std::string& name, T& value, const std::string& help);
  /// A value by its name.
  template <NamedEnum E>
  Option add_choice(const std::string& name, E& value, const std::string& help) {
    const auto take = [&value](const std::string& word) { value = *enum_named<E>(word); };
    return add_words(name, enum_names<E>(), name_of(value), take, help);
  }
  Option add_flag(const std::string& name, bool& value, const std::string& help);
  /// The value goes to a function, which may refuse_value().
  Option add_function(const std::string& name, const std::function<void(const std::string&)>& take,
                      const std::string& help);
  /// Without a value it is given "true"; also --name=VALUE is taken, whatever that is.
  Option add_switch(const std::string& name, std::function<void(const std::string&)> take,
                    const std::string& help);

  /// Options of which at least `least` and at most `most` must be given.
  Command add_group(const std::string& title, int least, int most);
  Command add_subcommand(const std::string& name, const std::string& what);
  void footer(const std::string& text);
  /// Called when the line chose this command and every option was right.
  void on_run(std::function<void()> run);

  /// Whether the line has it; false for an option that the command does not know.
  bool given(const std::string& option) const;
  std::vector<std::string> subcommands() const;

  /// The program's: null where it was given none.
  const std::shared_ptr<const Environment>& environment() const { return environment_; }

 private:
  /// `take` sees one of `words` only; `now` is what shown() shows.
  Option add_words(const std::string& name, std::vector<std::string> words, std::string now,
                   const std::function<void(const std::string&)>& take, const std::string& help);

  CLI::App* app_;
  std::shared_ptr<const Environment> environment_;
};

/// What the line lacks, or has wrong: ends the parsing as if the parser had found it.
[[noreturn]] void refuse_missing(const std::string& name);
[[noreturn]] void refuse_value(const std::string& name, const std::string& why);

/// The whole line.
class Program {
 public:
  Program(const std::string& description, const std::string& version,
          std::shared_ptr<const Environment> environment = nullptr);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  Command root() { return Command(app_.get(), environment_); }

  struct Parsed {
    bool ran = false;  // a command did; else help or the version was printed, or:
    bool good = true;
    std::string errors;  // lines that say why not
  };
  /// Runs the command that the line names; what it throws passes through.
  Parsed parse(int argc, const char* const* argv);

 private:
  std::unique_ptr<CLI::App> app_;
  std::shared_ptr<const Environment> environment_;
};

}  // namespace tind::cli
