#pragma once
// One client: bytes in, requests one after the other, replies out in the same order.
//
//   read -> parse -> route -> handle -> queue the reply -> (more in the buffer? again) -> one write
//
// A reply that a handler gives at once is queued behind its predecessors, and the whole queue goes
// out with one system call; a reply that comes later stops reading until it is there, which is all
// the back-pressure a pipelining client gets. What it waits for follows from its state alone, and
// every wait has a deadline but the one for a handler, during which we look now and then whether
// the client is still there (arm_deadline).

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "server/http/admission.h"
#include "server/http/byte_budget.h"
#include "server/http/io_loop.h"
#include "server/http/message/limits.h"
#include "server/http/message/request.h"
#include "server/http/message/request_parser.h"
#include "server/http/reply_queue.h"
#include "server/http/router.h"

namespace tind::http {

/// What every connection of a server shares; outlives them all.
struct ConnectionContext {
  const Router& router;
  const Limits& limits;
  ByteBudget& memory;
  bool access_log = false;
  /// Whose pages may read answers (CORS): all, or those listed, "https://example.org".
  bool any_origin = true;
  std::vector<std::string> origins = {};
};

class Connection final : public std::enable_shared_from_this<Connection>,
                         private TimerWheel::Timer,
                         private DeferredReply {
 public:
  /// `refused`: it is one too many, for that reason (a label of the metrics), and gets an answer
  /// only from routes that always give one.
  Connection(IoLoop& loop, const ConnectionContext& context, boost::asio::ip::tcp::socket socket,
             Slot slot, const char* refused = nullptr);
  ~Connection() override;

  void start();
  /// The loop is leaving: what was idle has little time left.
  void leave();
  /// Closes if it only waits for a request of which nothing has arrived, or nothing more for
  /// a while.
  bool give_way();
  /// The same of one that is there beyond the limit, whatever has arrived, and after its answer.
  bool give_up();
  const Address& address() const { return slot_.address(); }

 private:
  enum class State : std::uint8_t { idle, reading_head, reading_body, handling, lingering, closed };
  /// What has to happen before anything else can; see waits_for().
  enum class Wait : std::uint8_t {
    nothing,
    handler,
    first,
    another,
    head,
    body,
    client_to_read,
    client_to_go
  };

  // reading
  void read();
  void on_read(const boost::system::error_code& error, std::size_t size);
  void make_room();
  void process();
  bool take_next();
  void wait_for_more();

  // requests; false: nothing more can be done before something else happens
  bool take_head();
  void take_key();
  std::string origin_fields(const RequestHead&) const;
  const RequestHead& head() const { return without_key_ ? *without_key_ : parser_.head(); }
  bool begin_body(std::size_t max_body);
  bool make_room_for_body();
  void forget_body();
  bool take_body();
  bool call_handler();
  void refuse(int status, const char* why, const char* label);
  Responder responder() override;
  std::string client() const override;
  void on_later_reply(Reply reply);
  std::string_view path() const;

  // writing
  void queue(Reply reply);
  bool flush();
  void wait_until_writable();
  void on_writable(const boost::system::error_code& error);
  std::uint64_t taken_by_client() const;
  void log_reply(const Reply& reply, std::size_t bytes, double seconds) const;

  // waiting
  Wait waits_for() const;
  static bool is_unfinished(Wait);
  std::chrono::milliseconds time_for(Wait) const;
  void arm_deadline();
  void on_deadline() override;
  void act_on_deadline();
  void look_after_client();
  bool has_unread_bytes();

  // ending
  void linger();
  void close();

  IoLoop& loop_;
  const ConnectionContext& context_;
  boost::asio::ip::tcp::socket socket_;
  Slot slot_;
  const char* refused_;
  Link in_all_{this}, in_waiting_{this}, in_extra_{this};  // of loop_

  State state_ = State::idle;
  Wait armed_ = Wait::nothing;           // what the deadline is for
  bool renew_ = true;                    // a wait of the same kind would be another one
  bool served_ = false;                  // a request has come
  TimerWheel::Clock::time_point heard_;  // when a part of a request came
  std::uint64_t taken_ = 0;              // by the client, when the deadline for reading was set
  std::uint64_t written_ = 0;            // to the socket, since the beginning
  bool reading_ = false;                 // a read is under way
  bool writing_ = false;                 // waiting for the socket to take more
  bool closing_ = false;                 // nothing more is processed after what is queued
  bool linger_ = false;                  // closing, and the client may still be sending
  bool responder_taken_ = false;         // of the request being handled

  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;  // unprocessed bytes in buffer_
  RequestParser parser_;

  // The request being answered.
  bool keep_alive_ = true, head_only_ = false, http10_ = false;
  TimerWheel::Clock::time_point began_;
  std::string decoded_path_;                    // empty: the path needed no decoding
  std::string body_, log_method_, log_target_;  // no method: the bytes were refused, for that
  std::size_t body_left_ = 0;
  std::size_t body_held_ = 0;  // of the budget
  const Handler* handler_ = nullptr;
  Router::ErrorForm error_form_;  // of the request that is answered later
  std::array<std::string_view, 4> matched_;
  /// Of a request that had a key in its query: the head without it, and what that points into.
  std::optional<RequestHead> without_key_;
  std::string target_, key_;
  const Operation* operation_ = nullptr;
  std::shared_ptr<const Access> access_;
  std::string fields_;  // of the answer

  std::stop_source gone_{std::nostopstate};  // of the responder that was taken

  ReplyQueue queue_;
};

}  // namespace tind::http
