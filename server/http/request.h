#pragma once
// A request as handlers see it, and how they answer.

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "server/http/reply.h"
#include "server/http/request_parser.h"

namespace tind::http {

/// Valid until the handler returns: a handler that answers later copies what it needs.
struct Request {
  const RequestHead& head;
  std::string_view path;                    // decoded
  std::string_view body;                    // of a POST
  std::array<std::string_view, 4> matched;  // what the route's {...} matched, in order
};

/// The right to answer one request, once, from any thread. Dropped without an answer (an exception,
/// a queue that was emptied) it answers 500, so that no client waits for ever.
class Responder {
 public:
  using Send = std::move_only_function<void(Reply)>;
  explicit Responder(Send send) : send_(std::move(send)) {}
  Responder(Responder&& other) noexcept : send_(std::exchange(other.send_, nullptr)) {}
  Responder& operator=(Responder&&) = delete;
  ~Responder();

  void operator()(Reply reply) { std::exchange(send_, nullptr)(std::move(reply)); }

 private:
  Send send_;
};

/// How a handler says that its answer will come later.
class Later {
 public:
  virtual ~Later() = default;
  /// At most once per request; the handler then returns nothing.
  virtual Responder responder() = 0;
};

/// Runs on an I/O thread: never blocks, never computes. Answers at once, or takes
/// `later.responder()`, hands the work to somebody else and returns nothing.
using Handler = std::function<std::optional<Reply>(const Request&, Later& later)>;

}  // namespace tind::http
