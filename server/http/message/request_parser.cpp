#include "server/http/message/request_parser.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>

// The head is read line by line. A line's bytes are checked as they arrive (so that garbage is
// refused at its first bad byte), its structure when its LF is there, and what several fields say
// together when the empty line is there. All three happen in the order of the wire, which is why
// the verdict is the same for every way of splitting the bytes.

namespace tind::http {
namespace {

enum Class : std::uint8_t {
  kToken = 1,      // tchar of RFC 9110
  kPrintable = 2,  // 0x20..0x7e: the request line
  kFieldByte = 4,  // printable, HTAB and obs-text: field lines
  kHostByte = 8,   // reg-name without pct-encoded
};

constexpr std::array<std::uint8_t, 256> make_classes() {
  std::array<std::uint8_t, 256> classes{};
  for (int c = 0x20; c < 0x7f; ++c) classes[c] |= kPrintable | kFieldByte;
  for (int c = 0x80; c < 0x100; ++c) classes[c] |= kFieldByte;
  classes['\t'] |= kFieldByte;
  const auto add = [&](std::string_view bytes, std::uint8_t bit) {
    for (const char c : bytes) classes[static_cast<unsigned char>(c)] |= bit;
  };
  const std::string_view alnum = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";
  add(alnum, kToken | kHostByte);
  add("!#$%&'*+-.^_`|~", kToken);
  add("-._~!$&'()*+,;=", kHostByte);
  return classes;
}
constexpr auto kClasses = make_classes();

bool is(char c, std::uint8_t bits) { return kClasses[static_cast<unsigned char>(c)] & bits; }

char lower(char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; }

bool same_word(std::string_view text, std::string_view lower_case) {
  if (text.size() != lower_case.size()) return false;
  for (std::size_t i = 0; i < text.size(); ++i)
    if (lower(text[i]) != lower_case[i]) return false;
  return true;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_hex(char c) { return is_digit(c) || (lower(c) >= 'a' && lower(c) <= 'f'); }

std::optional<Method> method_of(std::string_view word) {
  for (const Method method : {Method::get, Method::head, Method::options, Method::post, Method::put,
                              Method::delete_, Method::patch})
    if (word == name(method)) return method;
  return std::nullopt;
}

bool may_have_body(Method method) {
  return method == Method::post || method == Method::put || method == Method::patch;
}

bool valid_port(std::string_view port) {
  if (port.size() > 5) return false;
  for (const char c : port)
    if (!is_digit(c)) return false;
  unsigned number = 0;
  std::from_chars(port.data(), port.data() + port.size(), number);
  return number <= 65535;
}

/// RFC 3986's IPv6address, which is what inet_pton reads.
bool valid_ipv6_literal(std::string_view inside) {
  if (inside.size() >= INET6_ADDRSTRLEN) return false;
  char text[INET6_ADDRSTRLEN] = {};
  inside.copy(text, inside.size());
  in6_addr address;
  return inet_pton(AF_INET6, text, &address) == 1;
}

bool valid_reg_name(std::string_view host) {
  for (std::size_t i = 0; i < host.size(); ++i) {
    if (host[i] == '%') {
      if (i + 2 >= host.size() || !is_hex(host[i + 1]) || !is_hex(host[i + 2])) return false;
      i += 2;
    } else if (!is(host[i], kHostByte)) {
      return false;
    }
  }
  return !host.empty() && host.size() <= 255;
}

}  // namespace

std::string_view name(Method method) {
  constexpr std::string_view kNames[] = {"GET", "HEAD",   "OPTIONS", "POST",
                                         "PUT", "DELETE", "PATCH"};
  return kNames[int(method)];
}

bool is_token(std::string_view text) {
  for (const char c : text)
    if (!is(c, kToken)) return false;
  return !text.empty();
}

bool valid_authority(std::string_view text) {
  if (text.starts_with('[')) {
    const auto close = text.find(']');
    if (close == text.npos || !valid_ipv6_literal(text.substr(1, close - 1))) return false;
    const std::string_view rest = text.substr(close + 1);
    return rest.empty() || (rest[0] == ':' && valid_port(rest.substr(1)));
  }
  const auto colon = text.find(':');
  if (!valid_reg_name(text.substr(0, colon))) return false;
  return colon == text.npos || valid_port(text.substr(colon + 1));
}

bool Fields::same(std::string_view name, std::string_view lower_name) {
  return same_word(name, lower_name);
}

std::optional<std::string_view> Fields::find(std::string_view lower_name) const {
  if (entries_)
    for (const Entry& entry : *entries_)
      if (same(entry.name.of(base_), lower_name)) return entry.value.of(base_);
  return std::nullopt;
}

RequestParser::State RequestParser::refuse(int status, const char* why, const char* label) {
  refusal_ = {status, why, label};
  return State::refused;
}

void RequestParser::reset() {
  fields_.clear();
  head_ = {};
  refusal_ = {};
  consumed_ = line_ = scanned_ = 0;
  has_request_line_ = skipped_empty_ = false;
}

/// Bytes [scanned_, end) belong to the current line, before its CR LF.
bool RequestParser::check_bytes(std::string_view view, std::size_t end) {
  const std::uint8_t allowed = has_request_line_ ? kFieldByte : kPrintable;
  for (; scanned_ < end; ++scanned_)
    if (!is(view[scanned_], allowed)) {
      refuse(400, "The request holds a byte that HTTP does not allow there.", "bad_byte");
      return false;
    }
  return true;
}

bool RequestParser::take_target(std::string_view target) {
  const auto bad = [&](const char* why) {
    refuse(400, why, "bad_target");
    return false;
  };
  head_.target = target;
  if (target == "*") {
    if (head_.method != Method::options) return bad("The target * goes with OPTIONS only.");
    head_.path = target;
    return true;
  }
  if (target.find('#') != target.npos) return bad("A request target has no fragment (#).");
  if (!target.starts_with('/')) {
    const std::size_t scheme = same_word(target.substr(0, 7), "http://")    ? 7
                               : same_word(target.substr(0, 8), "https://") ? 8
                                                                            : 0;
    if (scheme == 0) return bad("The request target must be a path that begins with /.");
    const std::size_t end = std::min(target.find_first_of("/?", scheme), target.size());
    head_.host = target.substr(scheme, end - scheme);
    if (!valid_authority(head_.host)) return bad("The host in the request target is not valid.");
    target.remove_prefix(end);
  }
  const std::size_t question = std::min(target.find('?'), target.size());
  head_.path = question == 0 ? std::string_view("/") : target.substr(0, question);
  if (question < target.size()) head_.query = target.substr(question + 1);
  return true;
}

bool RequestParser::take_request_line(const char* base, Slice line) {
  const auto bad = [&](int status, const char* why) {
    refuse(status, why, "bad_request_line");
    return false;
  };
  const std::string_view text = line.of(base);
  const auto first = text.find(' ');
  const auto last = text.rfind(' ');
  if (first == text.npos || first == last)
    return bad(400, "The request line must be: METHOD target HTTP/1.1");
  const std::string_view method = text.substr(0, first), version = text.substr(last + 1);
  const std::string_view target = text.substr(first + 1, last - first - 1);
  if (!is_token(method) || target.empty() || target.find(' ') != target.npos)
    return bad(400, "The request line must be: METHOD target HTTP/1.1");
  if (version.size() != 8 || !version.starts_with("HTTP/") || !is_digit(version[5]) ||
      version[6] != '.' || !is_digit(version[7]))
    return bad(400, "The request line must end in HTTP/1.1 or HTTP/1.0.");
  if (version != "HTTP/1.1" && version != "HTTP/1.0")
    return bad(505, "Only HTTP/1.1 and HTTP/1.0 are spoken here.");
  const std::optional<Method> known = method_of(method);
  if (!known) return bad(501, "This method is not known here.");
  head_.method = *known;
  head_.minor = version[7] - '0';
  request_line_ = line;
  has_request_line_ = true;
  return take_target(target);
}

bool RequestParser::take_field(const char* base, Slice line) {
  const auto bad = [&](int status, const char* why, const char* label) {
    refuse(status, why, label);
    return false;
  };
  const std::string_view text = line.of(base);
  if (text[0] == ' ' || text[0] == '\t')
    return bad(400, "A field must not be continued on a second line.", "obs_fold");
  const auto colon = text.find(':');
  if (colon == text.npos || !is_token(text.substr(0, colon)))
    return bad(400, "A field must be: name, colon, value.", "bad_field");
  if (fields_.size() == limits_->fields)
    return bad(431, "The request has too many fields.", "too_many_fields");
  std::size_t begin = colon + 1, end = text.size();
  while (begin < end && (text[begin] == ' ' || text[begin] == '\t')) ++begin;
  while (end > begin && (text[end - 1] == ' ' || text[end - 1] == '\t')) --end;
  const auto at = [&](std::size_t position) { return std::uint16_t(line.begin + position); };
  fields_.push_back({{line.begin, at(colon)}, {at(begin), at(end)}});
  return true;
}

bool RequestParser::take_line(const char* base, Slice line) {
  if (has_request_line_) return take_field(base, line);
  if (line.begin == line.end) {
    if (skipped_empty_) {
      refuse(400, "The request line is missing.", "bad_request_line");
      return false;
    }
    skipped_empty_ = true;
    return true;
  }
  return take_request_line(base, line);
}

bool RequestParser::take_host() {
  const auto bad = [&](const char* why) {
    refuse(400, why, "bad_host");
    return false;
  };
  int count = 0;
  std::string_view host;
  head_.fields.each("host", [&](std::string_view value) {
    ++count;
    host = value;
  });
  if (count == 0 && head_.minor == 1) return bad("An HTTP/1.1 request must have a Host field.");
  if (count > 1) return bad("A request must have only one Host field.");
  if (count == 1 && !valid_authority(host)) return bad("The Host field is not a valid host.");
  if (head_.host.empty()) head_.host = host;
  return true;
}

bool RequestParser::take_length() {
  const auto bad = [&](int status, const char* why) {
    refuse(status, why, "bad_framing");
    return false;
  };
  int codings = 0, lengths = 0;
  std::string_view length;
  head_.fields.each("transfer-encoding", [&](std::string_view) { ++codings; });
  head_.fields.each("content-length", [&](std::string_view value) {
    ++lengths;
    length = value;
  });
  if (codings > 0) {
    if (codings > 1 || lengths > 0 || head_.minor == 0)
      return bad(400, "Transfer-Encoding contradicts the rest of the request.");
    return bad(501, "Transfer-Encoding is not accepted; send a Content-Length.");
  }
  if (lengths == 0) return true;
  if (lengths > 1) return bad(400, "A request must have only one Content-Length.");
  if (length.empty() || length.size() > 18)
    return bad(400, "Content-Length is not a valid number.");
  for (const char c : length)
    if (!is_digit(c)) return bad(400, "Content-Length is not a valid number.");
  std::uint64_t number = 0;
  std::from_chars(length.data(), length.data() + length.size(), number);
  if (number > 0 && !may_have_body(head_.method))
    return bad(400, "This method does not take a body.");
  head_.content_length = number;
  return true;
}

void RequestParser::take_connection() {
  bool close = false, keep = false;
  head_.fields.each("connection", [&](std::string_view value) {
    while (!value.empty()) {
      const std::size_t comma = std::min(value.find(','), value.size());
      std::string_view word = value.substr(0, comma);
      while (!word.empty() && (word.front() == ' ' || word.front() == '\t')) word.remove_prefix(1);
      while (!word.empty() && (word.back() == ' ' || word.back() == '\t')) word.remove_suffix(1);
      close |= same_word(word, "close");
      keep |= same_word(word, "keep-alive");
      value.remove_prefix(std::min(comma + 1, value.size()));
    }
  });
  head_.keep_alive = !close && (head_.minor == 1 || keep);
}

RequestParser::State RequestParser::finish(const char* base) {
  // The buffer may have moved since the request line was read: read it again where it is now.
  head_.host = {};
  const std::string_view line = request_line_.of(base);
  const std::size_t first = line.find(' ') + 1;
  if (!take_target(line.substr(first, line.rfind(' ') - first))) return State::refused;
  head_.fields = Fields(base, fields_);
  if (!take_host() || !take_length()) return State::refused;
  take_connection();
  bool unknown_expectation = false;
  head_.fields.each("expect", [&](std::string_view value) {
    const bool is_continue = same_word(value, "100-continue");
    head_.expect_continue |= is_continue && head_.minor == 1;
    unknown_expectation |= !is_continue;
  });
  if (unknown_expectation) return refuse(417, "This expectation cannot be met.", "bad_expect");
  return State::done;
}

RequestParser::State RequestParser::parse(std::string_view buffer) {
  const std::string_view view = buffer.substr(0, limits_->head_bytes);
  while (true) {
    const void* found = scanned_ < view.size()
                            ? std::memchr(view.data() + scanned_, '\n', view.size() - scanned_)
                            : nullptr;
    if (!found) {
      // A CR may be the first half of CR LF: leave the last one for the next call.
      const bool pending = view.size() > scanned_ && view.back() == '\r';
      if (!check_bytes(view, view.size() - pending)) return State::refused;
      if (view.size() < limits_->head_bytes) return State::more;
      return has_request_line_
                 ? refuse(431, "The request's fields are too large.", "head_too_large")
                 : refuse(414, "The request target is too long.", "target_too_long");
    }
    const std::size_t lf = static_cast<const char*>(found) - view.data();
    const bool cr = lf > line_ && view[lf - 1] == '\r';
    const std::size_t end = cr ? lf - 1 : lf;
    if (!check_bytes(view, end)) return State::refused;
    if (!cr) return refuse(400, "A line must end in CR LF.", "bare_lf");
    const bool last = has_request_line_ && end == line_;
    const Slice line{std::uint16_t(line_), std::uint16_t(end)};
    line_ = scanned_ = lf + 1;
    if (last) {
      consumed_ = lf + 1;
      return finish(view.data());
    }
    if (!take_line(view.data(), line)) return State::refused;
  }
}

}  // namespace tind::http
