#pragma once
// The head of an HTTP/1 request, read under one strict policy (RFC 9110, RFC 9112; where they leave
// a choice, the choice that two programs cannot read differently):
//
//   * HTTP/1.0 and 1.1 only; request line and fields end in CR LF; no bare CR, no bare LF, no
//   obs-fold,
//     no space before a colon, no control bytes; at most one empty line before the request line
//   * target of bytes 0x21..0x7e without '#': origin-form, absolute-form with a valid authority, or
//     "*" with OPTIONS
//   * exactly one valid Host (HTTP/1.0 may have none)
//   * any Transfer-Encoding is refused; one Content-Length of digits only; a body only with POST,
//     PUT or PATCH
//   * bounded: head_bytes in all, `fields` fields
//
// A refusal always ends the connection: what follows it on the wire has no agreed meaning.
// No I/O here. The verdict does not depend on how the bytes are split over calls.

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "server/http/message/limits.h"

namespace tind::http {

enum class Method : std::uint8_t { get, head, options, post, put, delete_, patch };
std::string_view name(Method);

/// A run of bytes of the head; positions, because the buffer may move between two reads.
struct Slice {
  std::uint16_t begin = 0, end = 0;
  std::string_view of(const char* base) const { return {base + begin, std::size_t(end) - begin}; }
};

/// The fields in the order of the wire. Views into the buffer of the last parse().
class Fields {
 public:
  struct Entry {
    Slice name, value;  // value without surrounding white space
  };
  Fields() = default;
  Fields(const char* base, const std::vector<Entry>& entries) : base_(base), entries_(&entries) {}

  /// Calls f(value) for each field of that name (lower case), in order.
  template <class F>
  void each(std::string_view lower_name, F&& f) const {
    if (!entries_) return;
    for (const Entry& entry : *entries_)
      if (same(entry.name.of(base_), lower_name)) f(entry.value.of(base_));
  }
  /// The first field of that name (lower case), or nothing.
  std::optional<std::string_view> find(std::string_view lower_name) const;
  std::size_t size() const { return entries_ ? entries_->size() : 0; }

 private:
  static bool same(std::string_view name, std::string_view lower);
  const char* base_ = nullptr;
  const std::vector<Entry>* entries_ = nullptr;
};

/// A head that satisfies the policy. Views into the buffer of the last parse().
struct RequestHead {
  Method method = Method::get;
  int minor = 1;                 // HTTP/1.minor
  std::string_view target;       // as sent
  std::string_view path, query;  // of the target, still percent-encoded; query without '?'
  std::string_view host;         // from the target if absolute, else from Host; empty: HTTP/1.0
  Fields fields;
  std::optional<std::uint64_t> content_length;
  bool keep_alive = true;
  bool expect_continue = false;
};

struct Refusal {
  int status = 0;          // 4xx or 5xx
  const char* why = "";    // a sentence for the client
  const char* label = "";  // a word for the metrics
};

class RequestParser {
 public:
  enum class State { more, done, refused };

  explicit RequestParser(const Limits& limits) : limits_(&limits) {}

  /// `buffer` is everything received for this request: what earlier calls saw, and what came since.
  /// Work is linear in the new bytes. After `done` or `refused`, reset() before the next request.
  State parse(std::string_view buffer);

  /// REQUIRES: the last parse() said done, and its buffer is still there.
  const RequestHead& head() const { return head_; }
  /// Whatever parse() said: is it known to be HEAD, whose answer has no body?
  bool is_head() const { return has_request_line_ && head_.method == Method::head; }
  /// Bytes of the head, its empty line included.
  std::size_t consumed() const { return consumed_; }
  /// REQUIRES: the last parse() said refused.
  const Refusal& refusal() const { return refusal_; }

  void reset();

 private:
  State refuse(int status, const char* why, const char* label);
  bool check_bytes(std::string_view view, std::size_t end);
  bool take_line(const char* base, Slice line);
  bool take_request_line(const char* base, Slice line);
  bool take_target(std::string_view target);
  bool take_field(const char* base, Slice line);
  State finish(const char* base);
  bool take_host();
  bool take_length();
  void take_connection();

  const Limits* limits_;
  std::vector<Fields::Entry> fields_;
  RequestHead head_;
  Refusal refusal_;
  std::size_t consumed_ = 0;
  std::size_t line_ = 0;     // where the current line begins
  std::size_t scanned_ = 0;  // bytes before this are known to be good
  Slice request_line_;
  bool has_request_line_ = false, skipped_empty_ = false;
};

/// "example.org", "example.org:8080", "127.0.0.1", "[::1]:80": what Host may hold.
bool valid_authority(std::string_view);

/// A field name or method of RFC 9110: one or more tchar.
bool is_token(std::string_view);

}  // namespace tind::http
