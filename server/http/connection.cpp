#include "server/http/connection.h"

#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cstring>

#include "server/http/escape.h"
#include "server/http/problem.h"
#include "server/http/uri.h"

// Memory: an idle connection keeps a 1 KiB buffer, which holds most requests whole; it grows while
// a larger head arrives and shrinks when that is done with.
//
// Writing goes to the socket directly and only waits for it when it is full: on a local network
// a reply of any tile's size leaves with one system call, and nothing is copied.

namespace tind::http {
namespace {

constexpr std::size_t kSmallBuffer = 1024;
constexpr std::size_t kMaxQueued = 16;               // replies written with one call
constexpr std::size_t kMaxQueuedBytes = 256 * 1024;  // before the client must take some
constexpr std::size_t kBodyPiece = 64 * 1024;

double seconds_since(TimerWheel::Clock::time_point begin) {
  return std::chrono::duration<double>(TimerWheel::Clock::now() - begin).count();
}

std::string_view bytes_to_send(const Payload& payload, bool with_body) {
  return std::string_view(payload.bytes).substr(0, with_body ? payload.bytes.npos : payload.head);
}

}  // namespace

Responder::~Responder() {
  if (send_)
    (*this)(problem_reply({.status = 500, .detail = "The request was dropped inside the server."}));
}

Connection::Connection(IoLoop& loop, const ConnectionContext& context,
                       boost::asio::ip::tcp::socket socket)
    : loop_(loop), context_(context), socket_(std::move(socket)), parser_(context.limits) {
  next = loop_.first;
  link = &loop_.first;
  if (next) next->link = &next;
  loop_.first = this;
}

Connection::~Connection() { close(); }

void Connection::start() {
  loop_.set_deadline(*this, context_.limits.head_timeout);
  read();
}

void Connection::drain() {
  int arrived = 0;  // a request that we have not seen yet
  const bool waiting = ::ioctl(socket_.native_handle(), FIONREAD, &arrived) == 0 && arrived > 0;
  const bool busy = state_ == State::handling || writing_ || closing_ || begin_ != end_;
  if (!busy && !waiting) close();
}

// --- reading -------------------------------------------------------------------------------------

void Connection::make_room() {
  if (begin_ == end_) {
    begin_ = end_ = 0;
    if (buffer_.size() != kSmallBuffer) {
      buffer_ = std::vector<char>(kSmallBuffer);
    }
  } else if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  if (end_ == buffer_.size()) buffer_.resize(std::min(2 * end_, context_.limits.head_bytes));
}

void Connection::read() {
  if (reading_) return;
  reading_ = true;
  const auto done = [self = shared_from_this()](const boost::system::error_code& error,
                                                std::size_t size) { self->on_read(error, size); };
  if (state_ == State::reading_body) {
    body_.resize(body_.size() + std::min(body_left_, kBodyPiece));
    const std::size_t piece = std::min(body_left_, kBodyPiece);
    socket_.async_read_some(boost::asio::buffer(body_.data() + body_.size() - piece, piece), done);
    return;
  }
  make_room();
  socket_.async_read_some(boost::asio::buffer(buffer_.data() + end_, buffer_.size() - end_), done);
}

void Connection::on_read(const boost::system::error_code& error, std::size_t size) {
  reading_ = false;
  if (state_ == State::closed) return;
  if (error) return close();
  if (state_ == State::lingering) return read();  // and forget it
  if (state_ == State::reading_body) {
    body_.resize(body_.size() - std::min(body_left_, kBodyPiece) + size);
    body_left_ -= size;
  } else {
    end_ += size;
  }
  process();
}

/// Everything that can be done with what is here; replies leave together.
void Connection::process() {
  const auto keep = shared_from_this();
  bool more = true;
  while (more) {
    while (more && queue_.size() < kMaxQueued && queued_bytes_ < kMaxQueuedBytes)
      more = take_next();
    if (!flush()) return;
  }
  wait_for_more();
}

bool Connection::take_next() {
  if (closing_ || state_ == State::handling) return false;
  if (state_ == State::reading_body) return take_body();
  return begin_ != end_ && take_head();
}

/// Nothing is queued and nothing more can be done: what are we waiting for?
void Connection::wait_for_more() {
  if (closing_) return linger_ || begin_ != end_ ? linger() : close();
  if (state_ == State::handling) return;
  if (state_ == State::reading_body) return read();
  if (begin_ == end_) {
    if (loop_.draining) return close();
    state_ = State::idle;
    loop_.set_deadline(*this, context_.limits.idle_timeout);
  } else if (state_ != State::reading_head) {
    state_ = State::reading_head;
    loop_.set_deadline(*this, context_.limits.head_timeout);
  }
  read();
}

// --- requests ------------------------------------------------------------------------------------

std::string_view Connection::path() const {
  return decoded_path_.empty() ? parser_.head().path : decoded_path_;
}

bool Connection::take_head() {
  const auto state = parser_.parse({buffer_.data() + begin_, end_ - begin_});
  if (state == RequestParser::State::more) return false;
  if (state == RequestParser::State::refused) {
    const Refusal& refusal = parser_.refusal();
    refuse(refusal.status, refusal.why, refusal.label);
    return false;
  }
  const RequestHead& head = parser_.head();
  began_ = TimerWheel::Clock::now();
  keep_alive_ = head.keep_alive;
  head_only_ = head.method == Method::head;
  http10_ = head.minor == 0;
  body_.clear();
  decoded_path_.clear();
  if (context_.access_log) {
    log_target_.assign(name(head.method)).append(" ").append(escaped(head.target));
  }
  if (head.path.find('%') != head.path.npos) {
    auto decoded = percent_decode(head.path);
    if (!decoded) {
      refuse(400, "The path holds a bad percent-escape.", "bad_target");
      return false;
    }
    decoded_path_ = std::move(*decoded);
  }
  Request request{head, path(), {}, {}};
  auto routed = context_.router.route(request);
  if (Reply* reply = std::get_if<Reply>(&routed)) {
    reply->close |= head.content_length.value_or(0) > 0;  // an unread body follows
    begin_ += parser_.consumed();
    parser_.reset();
    queue(*reply);
    return !closing_;
  }
  const auto& match = std::get<Router::Match>(routed);
  handler_ = match.handler;
  matched_ = request.matched;
  return head.method == Method::post ? begin_body(match.max_body) : call_handler();
}

bool Connection::begin_body(std::size_t max_body) {
  const RequestHead& head = parser_.head();
  if (!head.content_length) {
    refuse(411, "A request with a body must have a Content-Length.", "no_length");
    return false;
  }
  if (*head.content_length > max_body) {
    refuse(413, "The body is larger than this resource takes.", "body_too_large");
    return false;
  }
  // What follows the body stays in the buffer, behind the head, whose views must not move.
  char* const after = buffer_.data() + begin_ + parser_.consumed();
  const std::size_t here = end_ - begin_ - parser_.consumed();
  const std::size_t taken = std::min<std::size_t>(here, *head.content_length);
  body_.assign(after, taken);
  std::memmove(after, after + taken, here - taken);
  end_ -= taken;
  body_left_ = *head.content_length - taken;
  if (body_left_ == 0) return call_handler();
  state_ = State::reading_body;
  loop_.set_deadline(*this, context_.limits.body_timeout);
  if (head.expect_continue) {
    constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
    Queued& interim = queue_.emplace_back();
    std::memcpy(interim.line.data(), kContinue.data(), kContinue.size());
    interim.line_size = kContinue.size();
  }
  return false;
}

bool Connection::take_body() {
  if (body_left_ > 0) return false;
  state_ = State::idle;
  return call_handler();
}

bool Connection::call_handler() {
  const Request request{parser_.head(), path(), body_, matched_};
  const State before = std::exchange(state_, State::handling);
  responder_taken_ = false;
  std::optional<Reply> reply;
  try {
    reply = (*handler_)(request, *this);
  } catch (const std::exception& error) {
    reply = problem_reply(Error{Errc::internal, error.what()}, request.head.target);
  }
  begin_ += parser_.consumed();
  parser_.reset();
  if (responder_taken_) {  // also after an exception: the responder answers, were it only with 500
    TimerWheel::cancel(*this);
    return false;
  }
  state_ = before;
  queue(reply ? *reply : problem_reply({.status = 500, .detail = "The handler did not answer."}));
  return !closing_;
}

Responder Connection::responder() {
  responder_taken_ = true;
  return Responder([self = shared_from_this()](Reply reply) mutable {
    // The connection goes along, so that it is only ever destroyed on its own thread.
    auto& context = self->loop_.context();
    boost::asio::post(context, [self = std::move(self), reply = std::move(reply)]() mutable {
      self->on_later_reply(std::move(reply));
    });
  });
}

void Connection::on_later_reply(Reply reply) {
  if (state_ == State::closed) return;
  state_ = State::idle;
  queue(reply);
  process();
}

void Connection::refuse(int status, const char* why, const char* label) {
  loop_.stats().count_rejected(label);
  began_ = TimerWheel::Clock::now();
  Reply reply = problem_reply({.status = status, .detail = why});
  reply.close = true;
  head_only_ = http10_ = false;
  if (context_.access_log) log_target_.assign("refused: ").append(label);
  queue(reply);
}

// --- writing -------------------------------------------------------------------------------------

void Connection::queue(const Reply& reply) {
  const bool keep = keep_alive_ && !reply.close && !loop_.draining;
  closing_ |= !keep;
  linger_ |= reply.close;
  Queued& queued = queue_.emplace_back();
  char* out = queued.line.data();
  const auto add = [&](std::string_view text) {
    std::memcpy(out, text.data(), text.size());
    out += text.size();
  };
  const char digits[3] = {char('0' + reply.status / 100), char('0' + reply.status / 10 % 10),
                          char('0' + reply.status % 10)};
  add("HTTP/1.1 ");
  add({digits, 3});
  add(" ");
  add(reason(reply.status));
  add("\r\n");
  add(loop_.date_line());
  if (!keep) {
    add("Connection: close\r\n");
  } else if (http10_) {
    add("Connection: keep-alive\r\n");
  }
  queued.line_size = std::uint8_t(out - queued.line.data());
  queued.with_body = !head_only_;
  queued.payload = reply.payload;
  queued_bytes_ += queued.line_size + bytes_to_send(*reply.payload, queued.with_body).size();
  const double seconds = seconds_since(began_);
  loop_.stats().count_reply(reply.status, seconds);
  if (context_.access_log) log_reply(reply, seconds);
}

void Connection::log_reply(const Reply& reply, double seconds) const {
  spdlog::info("{} {} {} {:.3f} ms", log_target_, reply.status,
               bytes_to_send(*reply.payload, !head_only_).size() - reply.payload->head,
               seconds * 1e3);
}

/// True when everything has been taken by the socket; else it goes on by itself, or has closed.
bool Connection::flush() {
  while (!queue_.empty()) {
    if (writing_) return false;
    std::array<iovec, 2 * kMaxQueued + 2> pieces;
    std::size_t count = 0, skip = sent_;
    const auto add = [&](std::string_view bytes) {
      const std::size_t skipped = std::min(skip, bytes.size());
      skip -= skipped;
      if (skipped == bytes.size()) return;
      pieces[count++] = {const_cast<char*>(bytes.data()) + skipped, bytes.size() - skipped};
    };
    for (const Queued& queued : queue_) {
      if (count + 2 > pieces.size()) break;
      add({queued.line.data(), queued.line_size});
      if (queued.payload) add(bytes_to_send(*queued.payload, queued.with_body));
    }
    msghdr message{};
    message.msg_iov = pieces.data();
    message.msg_iovlen = count;
    const ssize_t sent = ::sendmsg(socket_.native_handle(), &message, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent >= 0) {
      drop_sent(std::size_t(sent));
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      writing_ = true;
      loop_.set_deadline(*this, context_.limits.write_timeout);
      socket_.async_wait(
          boost::asio::ip::tcp::socket::wait_write,
          [self = shared_from_this()](const auto& error) { self->on_writable(error); });
      return false;
    } else if (errno != EINTR) {
      close();
      return false;
    }
  }
  return state_ != State::closed;
}

void Connection::drop_sent(std::size_t sent) {
  loop_.stats().count_sent(sent);
  sent_ += sent;
  std::size_t done = 0;
  for (const Queued& queued : queue_) {
    std::size_t size = queued.line_size;
    if (queued.payload) size += bytes_to_send(*queued.payload, queued.with_body).size();
    if (sent_ < size) break;
    sent_ -= size;
    queued_bytes_ -= std::min(size, queued_bytes_);
    ++done;
  }
  queue_.erase(queue_.begin(), queue_.begin() + std::ptrdiff_t(done));
}

void Connection::on_writable(const boost::system::error_code& error) {
  if (state_ == State::closed) return;
  if (error) return close();
  writing_ = false;
  TimerWheel::cancel(*this);
  process();
}

// --- ending --------------------------------------------------------------------------------------

void Connection::on_deadline() {
  const auto keep = shared_from_this();
  if (writing_ || state_ == State::lingering || state_ == State::idle) return close();
  refuse(408, "The request did not arrive in time.", "timeout");
  process();
}

/// A client that is still sending would get a reset, and lose our last reply: stop writing, read
/// on for a moment, then close.
void Connection::linger() {
  state_ = State::lingering;
  begin_ = end_ = 0;
  boost::system::error_code ignored;
  socket_.shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
  loop_.set_deadline(*this, context_.limits.linger_timeout);
  read();
}

void Connection::close() {
  if (state_ == State::closed) return;
  state_ = State::closed;
  TimerWheel::cancel(*this);
  *link = next;
  if (next) next->link = link;
  boost::system::error_code ignored;
  socket_.close(ignored);
  loop_.open.fetch_sub(1, std::memory_order_relaxed);
}

}  // namespace tind::http
