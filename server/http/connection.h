#pragma once
// One client: bytes in, requests one after the other, replies out in the same order.
//
//   read -> parse -> route -> handle -> queue the reply -> (more in the buffer? again) -> one write
//
// A reply that a handler gives at once is queued behind its predecessors, and the whole queue goes
// out with one system call; a reply that comes later stops reading until it is there, which is all
// the back-pressure a pipelining client gets. Every state has a deadline but "a handler is
// working".

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/http/io_loop.h"
#include "server/http/limits.h"
#include "server/http/request.h"
#include "server/http/request_parser.h"
#include "server/http/router.h"

namespace tind::http {

/// What every connection of a server shares; outlives them all.
struct ConnectionContext {
  const Router& router;
  const Limits& limits;
  bool access_log = false;
};

class Connection final : public std::enable_shared_from_this<Connection>,
                         private TimerWheel::Timer,
                         private Later {
 public:
  /// Takes the socket. The count in loop.open was raised by the caller; the destructor lowers it.
  Connection(IoLoop& loop, const ConnectionContext& context, boost::asio::ip::tcp::socket socket);
  ~Connection() override;

  void start();
  /// Closes when idle, else after the requests that have been read.
  void drain();

  Connection* next = nullptr;  // in loop.first
  Connection** link = nullptr;

 private:
  enum class State : std::uint8_t { idle, reading_head, reading_body, handling, lingering, closed };

  struct Queued {
    std::array<char, 128> line;  // status line, Date, Connection
    std::uint8_t line_size = 0;
    bool with_body = true;
    std::shared_ptr<const Payload> payload;  // null: an interim response
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
  bool begin_body(std::size_t max_body);
  bool take_body();
  bool call_handler();
  void refuse(int status, const char* why, const char* label);
  Responder responder() override;
  void on_later_reply(Reply reply);
  std::string_view path() const;

  // writing
  void queue(const Reply& reply);
  bool flush();
  void drop_sent(std::size_t sent);
  void on_writable(const boost::system::error_code& error);
  void log_reply(const Reply& reply, double seconds) const;

  // ending
  void on_deadline() override;
  void linger();
  void close();

  IoLoop& loop_;
  const ConnectionContext& context_;
  boost::asio::ip::tcp::socket socket_;

  State state_ = State::idle;
  bool reading_ = false;          // a read is under way
  bool writing_ = false;          // waiting for the socket to take more
  bool closing_ = false;          // nothing more is processed after what is queued
  bool linger_ = false;           // closing, and the client may still be sending
  bool responder_taken_ = false;  // of the request being handled

  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;  // unprocessed bytes in buffer_
  RequestParser parser_;

  // The request being answered.
  bool keep_alive_ = true, head_only_ = false, http10_ = false;
  TimerWheel::Clock::time_point began_;
  std::string decoded_path_;  // empty: the path needed no decoding
  std::string body_, log_target_;
  std::size_t body_left_ = 0;
  const Handler* handler_ = nullptr;
  std::array<std::string_view, 4> matched_;

  std::vector<Queued> queue_;
  std::size_t queued_bytes_ = 0;
  std::size_t sent_ = 0;  // of queue_.front()
};

}  // namespace tind::http
