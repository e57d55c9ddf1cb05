// Any bytes as a request: the parser's verdict is the same whole and byte by byte, what it
// accepts satisfies its policy, and everything behind it (router, query, conditions) takes any
// accepted head.

#include <cstdint>
#include <cstdlib>
#include <string>

#include "server/http/message/negotiate.h"
#include "server/http/message/request_parser.h"
#include "server/http/message/uri.h"
#include "server/http/router.h"

namespace {

using namespace tind::http;

void require(bool condition) {
  if (!condition) std::abort();
}

const Router& router() {
  static const Router made = [] {
    Router table;
    const Handler nothing = [](const Request&, DeferredReply&) { return std::optional<Reply>(); };
    table.get("/", nothing);
    table.get("/terrain/{dataset}/{z}/{x}/{y}.terrain", nothing);
    table.get("/viewer/{path...}", nothing);
    table.post("/simplify", {.max_bytes = 100}, nothing);
    return table;
  }();
  return made;
}

void use(const RequestHead& head) {
  require(head.target == "*" || head.path.starts_with('/'));
  require(head.minor == 0 || !head.host.empty());
  for (const char c : head.target) require(c >= 0x21 && c <= 0x7e);
  require(!head.fields.find("transfer-encoding"));
  const Conditions conditions(head.fields);
  (void)lists_etag(conditions.none_match, "\"x\"");
  (void)parse_query(head.query);
  const auto path = percent_decode(head.path);
  if (!path) return;
  Request request{head, *path, {}, {}};
  (void)router().route(request);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using State = RequestParser::State;
  static const Limits limits;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  RequestParser whole(limits), split(limits);
  const State verdict = whole.parse(bytes);
  State piecewise = State::more;
  for (std::size_t end = 1; end <= size && piecewise == State::more; ++end)
    piecewise = split.parse({bytes.data(), end});
  require(size == 0 || verdict == piecewise);
  if (verdict == State::refused) require(whole.refusal().status == split.refusal().status);
  if (verdict != State::done) return 0;
  require(whole.consumed() == split.consumed());
  use(whole.head());
  return 0;
}
