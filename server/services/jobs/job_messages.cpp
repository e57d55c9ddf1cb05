#include "server/services/jobs/job_messages.h"

#include <charconv>
#include <csignal>

#include "terrain/base/short_text.h"

namespace tind::services {
namespace {

constexpr std::size_t kLongest = 500;

void replace_all(std::string& text, const std::string& what, const std::string& with) {
  if (what.empty()) return;
  for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += with.size())
    text.replace(at, what.size(), with);
}

/// A message without the paths that are in it: they are for the log.
std::string without_paths(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool begins = text[i] == '/' && (i == 0 || text[i - 1] == ' ' || text[i - 1] == '\'' ||
                                           text[i - 1] == '"' || text[i - 1] == '(');
    if (!begins) {
      out += text[i];
      continue;
    }
    out += "...";
    while (i + 1 < text.size() && std::string_view(" ,;:)'\"").find(text[i + 1]) == text.npos) ++i;
  }
  return out;
}

}  // namespace

std::optional<int> progress_in(std::string_view line) {
  const std::size_t sign = line.find(" %");
  if (sign == line.npos) return {};
  std::size_t begin = sign;
  while (begin > 0 && line[begin - 1] >= '0' && line[begin - 1] <= '9') --begin;
  if (begin < 2 || line.substr(begin - 2, 2) != ": ") return {};
  int value = 0;
  const auto [end, error] = std::from_chars(line.data() + begin, line.data() + sign, value);
  if (error != std::errc() || value > 100) return {};
  return value;
}

std::string for_client(std::string message, const std::string& folder,
                       const std::vector<std::pair<std::string, std::string>>& names) {
  for (const auto& [path, name] : names) replace_all(message, path, name);
  replace_all(message, folder + "/", "");
  message = without_paths(message);
  message.resize(short_text(message, kLongest).size());
  return message;
}

bool from_outside(int signal) {
  return signal == SIGKILL || signal == SIGTERM || signal == SIGINT || signal == SIGHUP;
}

std::string result_too_large(std::uint64_t bytes) {
  return "its result is larger than those of jobs may be, " + std::to_string(bytes >> 20) +
         " MB: ask for a smaller area, or for less detail";
}

std::string why_killed(int signal) {
  if (signal == SIGXCPU) return "it took more CPU time than jobs may: ask for a smaller area";
  if (from_outside(signal))
    return "it was ended from outside, twice: by the operator, or by a system that had no memory "
           "left";
  return "it ended by a fault, which is a bug; the log has its number";
}

}  // namespace tind::services
