#pragma once
// A request as handlers see it, and how they answer.

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/http/message/reply.h"
#include "server/http/message/request_parser.h"

namespace tind::http {

struct Operation;  // server/http/operation.h

/// What somebody who showed a key may see.
struct Access {
  std::string name;                   // of the key: for logs, never the key itself
  std::vector<std::string> datasets;  // empty: all
  bool sees(std::string_view dataset) const {
    return datasets.empty() || std::ranges::find(datasets, dataset) != datasets.end();
  }
};

/// Valid until the handler returns, the body until the responder has answered: a handler that
/// answers later copies what it needs of the rest.
struct Request {
  const RequestHead& head;
  std::string_view path;                           // decoded
  std::string_view body;                           // of a POST
  std::array<std::string_view, 4> matched;         // what the route's {...} matched, in order
  std::array<std::uint8_t, 16> from = {};          // address_of() the client
  std::string_view key = {};                       // that came in the query, which has it no more
  const Operation* operation = nullptr;            // of the route; null where it says none
  std::shared_ptr<const Access> access = nullptr;  // null: sees everything
  std::string fields = {};  // lines for the answer, whatever it is: "Name: value\r\n"
  bool any_origin = false;  // every web page may read the answer

  bool sees(std::string_view dataset) const { return !access || access->sees(dataset); }
};

/// Who asked, for those who answer later.
struct Asker {
  std::stop_token gone;  // stopped once it has hung up: what is done for it alone may end
  std::string client;    // DeferredReply::client(); empty: nobody in particular
};

/// The right to answer one request, once, from any thread. Dropped without an answer (an exception,
/// a queue that was emptied) it answers 500, so that no client waits for ever.
class Responder {
 public:
  using Send = std::move_only_function<void(Reply)>;
  explicit Responder(Send send, Asker asker = {})
      : send_(std::move(send)), asker_(std::move(asker)) {}
  Responder(Responder&& other) noexcept
      : send_(std::exchange(other.send_, nullptr)), asker_(std::move(other.asker_)) {}
  Responder& operator=(Responder&&) = delete;
  ~Responder();

  /// Of one that has gone: answer all the same.
  const Asker& asker() const { return asker_; }

  void operator()(Reply reply) { std::exchange(send_, nullptr)(std::move(reply)); }

 private:
  Send send_;
  Asker asker_;
};

/// How a handler says that its answer will come later.
class DeferredReply {
 public:
  virtual ~DeferredReply() = default;
  /// At most once per request; the handler then returns nothing.
  virtual Responder responder() = 0;
  /// Whose request it is: the name of the key, or the address at the other end, of IPv6 the 64 bits
  /// that one client has.
  virtual std::string client() const = 0;
};

/// Runs on an I/O thread: never blocks, never computes. Answers at once, or takes
/// `deferred.responder()`, hands the work to somebody else and returns nothing.
using Handler = std::function<std::optional<Reply>(const Request&, DeferredReply& deferred)>;

}  // namespace tind::http
