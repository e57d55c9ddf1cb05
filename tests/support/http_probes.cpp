#include "tests/support/http_probes.h"

#include <charconv>
#include <fstream>
#include <stdexcept>

#include "tests/support/support.h"

namespace tind::test {
namespace {

using std::string;

/// The bytes that the table's text stands for, up to a `}` or the end.
string unescape(std::string_view& text) {
  string bytes;
  while (!text.empty() && text[0] != '}') {
    const char c = text[0];
    text.remove_prefix(1);
    if (c != '\\') {
      bytes += c;
      continue;
    }
    const char kind = text.at(0);
    text.remove_prefix(1);
    if (kind == 'x') {
      unsigned value = 0;
      std::from_chars(text.data(), text.data() + 2, value, 16);
      bytes += char(value);
      text.remove_prefix(2);
    } else if (kind == '{') {
      int times = 0;
      std::from_chars(text.data(), text.data() + text.size(), times);
      text.remove_prefix(text.find(':') + 1);
      const string unit = unescape(text);
      text.remove_prefix(1);
      for (int i = 0; i < times; ++i) bytes += unit;
    } else {
      bytes += kind == 'r' ? '\r' : kind == 'n' ? '\n' : kind == 't' ? '\t' : kind;
    }
  }
  return bytes;
}

Probe probe_of(const string& line) {
  const auto first = line.find('\t'), second = line.find('\t', first + 1),
             third = line.find('\t', second + 1);
  if (third == line.npos) throw std::runtime_error("http_probes.txt: " + line);
  std::string_view text = std::string_view(line).substr(third + 1);
  return {line.substr(0, first), line.substr(first + 1, second - first - 1),
          std::stoi(line.substr(second + 1)), unescape(text)};
}

std::vector<Probe> all() {
  std::ifstream in(testdata("http_probes.txt"));
  std::vector<Probe> table;
  for (string line; std::getline(in, line);)
    if (!line.empty() && line[0] != '#') table.push_back(probe_of(line));
  return table;
}

}  // namespace

const std::vector<Probe>& probes() {
  static const std::vector<Probe> table = all();
  return table;
}

}  // namespace tind::test
