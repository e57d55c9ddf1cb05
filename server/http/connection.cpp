#include "server/http/connection.h"

#include <linux/sockios.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cstring>

#include "server/http/message/escape.h"
#include "server/http/message/problem.h"
#include "server/http/message/uri.h"
#include "server/log/log.h"
#include "terrain/base/caught.h"

// Memory: an idle connection keeps a 1 KiB buffer, which holds most requests whole; it grows while
// a larger head arrives and shrinks when that is done with.
//
// Writing goes to the socket directly and only waits for it when it is full: on a local network
// a reply of any tile's size leaves with one system call, and nothing is copied.

namespace tind::http {
namespace {

constexpr std::size_t kSmallBuffer = 1024;
constexpr std::size_t kBodyPiece = 64 * 1024;
constexpr const char* kNoMemory =
    "The server holds as much for its clients as it may; try again soon.";
constexpr std::size_t kSmallReply = 4096;  // is never refused for want of memory

double seconds_since(TimerWheel::Clock::time_point begin) {
  return std::chrono::duration<double>(TimerWheel::Clock::now() - begin).count();
}

bool is_error(const Reply& reply) { return reply.status >= 400; }

void form_error(Reply& reply, const Router::ErrorForm& form) {
  if (form) reply = form(reply);
}

}  // namespace

Responder::~Responder() {
  if (!send_) return;
  if (asker_.gone.stop_requested())
    (*this)(problem_reply({.status = 503, .detail = "The client seemed to have hung up."}));
  else
    (*this)(problem_reply({.status = 500, .detail = "The request was dropped inside the server."}));
}

Connection::Connection(IoLoop& loop, const ConnectionContext& context,
                       boost::asio::ip::tcp::socket socket, Slot slot, const char* refused)
    : loop_(loop),
      context_(context),
      socket_(std::move(socket)),
      slot_(std::move(slot)),
      refused_(refused),
      parser_(context.limits),
      queue_(context.memory, slot_.address()) {
  in_all_.enter_last(loop_.all);
  if (refused_) in_extra_.enter_last(loop_.extra);
}

Connection::~Connection() {
  close();
  forget_body();  // only now: a worker may have been reading it
}

void Connection::start() {
  arm_deadline();
  read();
}

void Connection::leave() {
  renew_ |= armed_ == Wait::first || armed_ == Wait::another;
  arm_deadline();
}

bool Connection::give_way() {
  const bool idle = armed_ == Wait::first || armed_ == Wait::another;
  const bool stalled =
      is_unfinished(armed_) && TimerWheel::Clock::now() - heard_ >= context_.limits.stall_age;
  if (!(idle || stalled) || has_unread_bytes()) return false;
  close();
  return true;
}

bool Connection::give_up() {
  const bool waits = armed_ == Wait::first || armed_ == Wait::head || armed_ == Wait::client_to_go;
  if (waits) close();
  return waits;
}

// --- waiting -------------------------------------------------------------------------------------

Connection::Wait Connection::waits_for() const {
  if (state_ == State::closed) return Wait::nothing;
  if (writing_) return Wait::client_to_read;
  switch (state_) {
    case State::idle:
      return served_ ? Wait::another : Wait::first;
    case State::reading_head:
      return Wait::head;
    case State::reading_body:
      return Wait::body;
    case State::lingering:
      return Wait::client_to_go;
    case State::handling:
      return Wait::handler;
    case State::closed:
      break;
  }
  return Wait::nothing;
}

std::chrono::milliseconds Connection::time_for(Wait wait) const {
  const Limits& limits = context_.limits;
  switch (wait) {
    case Wait::first:
    case Wait::another: {
      const auto time = wait == Wait::another ? limits.idle_timeout : limits.head_timeout;
      if (refused_) return limits.extra_timeout;
      return loop_.leaving ? std::min(time, limits.quiet_timeout) : time;
    }
    case Wait::head:
      return refused_ ? limits.extra_timeout : limits.head_timeout;
    case Wait::body:
      return limits.body_timeout;
    case Wait::client_to_read:
      return limits.write_timeout;
    case Wait::handler:
      return limits.look_after;
    case Wait::client_to_go:
      return loop_.leaving ? std::min(limits.linger_timeout, limits.quiet_timeout)
                           : limits.linger_timeout;
    case Wait::nothing:
      break;
  }
  return {};
}

bool Connection::is_unfinished(Wait wait) { return wait == Wait::head || wait == Wait::body; }

/// The one place where deadlines are set. To be called whenever nothing more can be done for now; a
/// wait that goes on keeps the deadline that it has.
void Connection::arm_deadline() {
  const Wait wait = waits_for();
  if (is_unfinished(wait) && !refused_) {  // something has just arrived
    heard_ = TimerWheel::Clock::now();
    in_waiting_.enter_last(loop_.unfinished);
  }
  if (wait == armed_ && !renew_) return;
  const auto counts = [&](Wait w) {
    return !refused_ && (w == Wait::first || w == Wait::another || is_unfinished(w));
  };
  if (counts(wait) != counts(armed_)) {
    const std::size_t now = loop_.waiting.load(std::memory_order_relaxed);
    loop_.waiting.store(counts(wait) ? now + 1 : now - 1, std::memory_order_relaxed);
  }
  armed_ = wait;
  renew_ = false;
  if (counts(wait)) {
    if (!is_unfinished(wait))
      in_waiting_.enter_last(wait == Wait::first ? loop_.silent : loop_.kept);
  } else {
    in_waiting_.leave();
  }
  if (wait == Wait::nothing) return TimerWheel::cancel(*this);
  if (wait == Wait::client_to_read) taken_ = taken_by_client();
  loop_.set_deadline(*this, time_for(wait));
}

void Connection::on_deadline() {
  const auto keep = shared_from_this();
  renew_ = true;  // whatever is waited for after this
  try {
    act_on_deadline();
  } catch (...) {
    close();  // it has no deadline any more
    throw;
  }
}

void Connection::act_on_deadline() {
  const Limits& limits = context_.limits;
  switch (armed_) {
    case Wait::head:
      // Where so much of it could be read; not of the request before it.
      head_only_ = parser_.is_head(), http10_ = false;
      [[fallthrough]];
    case Wait::body:
      refuse(408, "The request did not arrive in time.", "timeout");
      return process();
    case Wait::client_to_read: {
      const double least =
          double(limits.write_rate) * std::chrono::duration<double>(limits.write_timeout).count();
      return double(taken_by_client() - taken_) < least ? close() : arm_deadline();
    }
    case Wait::first:
    case Wait::another:
      return has_unread_bytes() ? arm_deadline() : close();
    case Wait::handler:
      return look_after_client();
    case Wait::client_to_go:
    case Wait::nothing:
      return close();
  }
}

/// Of a request that is about to be read.
bool Connection::has_unread_bytes() {
  int arrived = 0;
  return ::ioctl(socket_.native_handle(), FIONREAD, &arrived) == 0 && arrived > 0;
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
    const std::size_t piece = std::min(body_left_, kBodyPiece);
    body_.resize(body_.size() + piece);
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
  bool more = true, flushed = true;
  while (more && flushed) {
    while (more && queue_.has_room()) more = take_next();
    flushed = flush();
  }
  if (flushed) wait_for_more();
  arm_deadline();
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
  if (state_ == State::reading_body) {
    if (make_room_for_body()) return read();
    forget_body();
    refuse(503, kNoMemory, "memory");
    return process();
  }
  state_ = begin_ == end_ ? State::idle : State::reading_head;
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
    head_only_ = http10_ = false;  // of the request before it
    refuse(refusal.status, refusal.why, refusal.label);
    return false;
  }
  take_key();
  const RequestHead& head = this->head();
  began_ = TimerWheel::Clock::now();
  served_ = renew_ = true;
  fields_ = context_.any_origin ? std::string() : origin_fields(head);
  operation_ = nullptr;
  access_ = nullptr;
  keep_alive_ = head.keep_alive;
  head_only_ = head.method == Method::head;
  http10_ = head.minor == 0;
  forget_body();
  decoded_path_.clear();
  if (context_.access_log) {
    log_method_ = name(head.method);
    log_target_ = escaped(head.target);
  }
  if (head.path.find('%') != head.path.npos) {
    auto decoded = percent_decode(head.path);
    if (!decoded) {
      refuse(400, "The path holds a bad percent-escape.", "bad_target");
      return false;
    }
    decoded_path_ = std::move(*decoded);
  }
  Request request{head, path(), {}, {}, slot_.address(), key_};
  request.any_origin = context_.any_origin;
  auto routed = context_.router.route(request);
  key_.clear();
  fields_ += request.fields;
  if (Reply* reply = std::get_if<Reply>(&routed)) {
    if (is_error(*reply)) form_error(*reply, context_.router.error_form(request));
    reply->close |= head.content_length.value_or(0) > 0;  // an unread body follows
    begin_ += parser_.consumed();
    parser_.reset();
    queue(*reply);
    return !closing_;
  }
  const auto& match = std::get<Router::Match>(routed);
  if (refused_ && !match.always) {
    refuse(503, "Too many clients are connected; try again soon.", refused_);
    return false;
  }
  handler_ = match.handler;
  matched_ = request.matched;
  operation_ = request.operation;
  access_ = std::move(request.access);
  return head.method == Method::post ? begin_body(match.max_body) : call_handler();
}

/// A key in the query leaves it before anybody else sees the target, so that it comes into no log
/// and no answer.
void Connection::take_key() {
  without_key_.reset();
  const RequestHead& sent = parser_.head();
  const std::size_t query = sent.target.size() - sent.query.size();
  if (sent.query.empty()) return;
  std::string kept;
  bool found = false;
  for (std::string_view rest = sent.query; !rest.empty();) {
    const std::string_view part = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(part.size() + 1, rest.size()));
    const std::string_view name = part.substr(0, part.find('='));
    if (name == "key" || (name.find('%') != name.npos && percent_decode(name) == "key")) {
      found = true;
      key_ = percent_decode(part.substr(std::min(name.size() + 1, part.size()))).value_or("");
    } else {
      kept.append(kept.empty() ? "" : "&").append(part);
    }
  }
  if (!found) return;
  target_.assign(sent.target.substr(0, query - (kept.empty() ? 1 : 0))).append(kept);
  without_key_ = sent;
  const std::string_view all = target_;
  without_key_->target = all;
  without_key_->query = all.substr(all.size() - kept.size());
}

std::string Connection::origin_fields(const RequestHead& head) const {
  const auto origin = head.fields.find("origin");
  std::string fields = "Vary: Origin\r\n";
  if (origin && std::ranges::find(context_.origins, *origin) != context_.origins.end())
    fields.append("Access-Control-Allow-Origin: ").append(*origin).append("\r\n");
  return fields;
}

bool Connection::begin_body(std::size_t max_body) {
  const RequestHead& head = this->head();
  if (!head.content_length && max_body == 0) return call_handler();  // says that there is none
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
  body_.assign(after, taken);  // no more than a head may be long
  std::memmove(after, after + taken, here - taken);
  end_ -= taken;
  body_left_ = *head.content_length - taken;
  if (body_left_ == 0) return call_handler();
  state_ = State::reading_body;
  if (head.expect_continue) {
    QueuedReply interim;
    interim.add_line("HTTP/1.1 100 Continue\r\n\r\n");
    queue_.add(std::move(interim));
  }
  return false;
}

/// Room in the body, and in the budget, for what is read next. It grows with what has arrived, not
/// with what was announced.
bool Connection::make_room_for_body() {
  const std::size_t needed = body_.size() + std::min(body_left_, kBodyPiece);
  if (needed > body_.capacity()) {
    const std::size_t room = std::min(2 * needed, body_.size() + body_left_);
    if (!context_.memory.take(slot_.address(), room - body_held_)) return false;
    body_held_ = room;
    body_.reserve(room);
  }
  return true;
}

void Connection::forget_body() {
  if (body_.capacity() > kSmallBuffer) std::string().swap(body_);
  body_.clear();
  context_.memory.give_back(slot_.address(), std::exchange(body_held_, 0));
}

bool Connection::take_body() {
  if (body_left_ > 0) return false;
  state_ = State::idle;
  return call_handler();
}

bool Connection::call_handler() {
  const Request request{head(), path(), body_, matched_, slot_.address(), {}, operation_, access_};
  const State before = std::exchange(state_, State::handling);
  responder_taken_ = false;
  std::optional<Reply> reply;
  try {
    reply = (*handler_)(request, *this);
  } catch (const std::exception& error) {
    reply = problem_reply(caught(error), request.head.target);
  }
  if (reply && is_error(*reply)) form_error(*reply, context_.router.error_form(request));
  begin_ += parser_.consumed();
  parser_.reset();
  // Also after an exception: the responder answers, were it only with 500.
  if (responder_taken_) return false;
  state_ = before;
  queue(reply ? *reply : problem_reply({.status = 500, .detail = "The handler did not answer."}));
  return !closing_;
}

Responder Connection::responder() {
  responder_taken_ = true;
  gone_ = std::stop_source();
  error_form_ = context_.router.error_form({head(), path(), {}, matched_, slot_.address()});
  return Responder(
      [self = shared_from_this()](Reply reply) mutable {
        // The connection goes along, so that it is only ever destroyed on its own thread.
        auto& context = self->loop_.context();
        boost::asio::post(context, [self = std::move(self), reply = std::move(reply)]() mutable {
          self->on_later_reply(std::move(reply));
        });
      },
      {gone_.get_token(), client()});
}

/// Not the socket's peer: one that has reset its connection has none any more, and would be nobody.
std::string Connection::client() const {
  if (access_) return "key " + access_->name;
  const auto address = boost::asio::ip::make_address_v6(slot_.address());
  if (!address.is_v4_mapped()) return address.to_string();
  const auto v4 = boost::asio::ip::make_address_v4(boost::asio::ip::v4_mapped, address);
  return v4.is_unspecified() ? "unix" : v4.to_string();  // of a socket in the file system
}

void Connection::on_later_reply(Reply reply) {
  if (state_ == State::closed) return;
  state_ = State::idle;
  gone_ = std::stop_source(std::nostopstate);
  if (is_error(reply)) form_error(reply, error_form_);
  error_form_ = nullptr;
  queue(reply);
  process();
}

void Connection::refuse(int status, const char* why, const char* label) {
  loop_.stats().count_rejected(label);
  began_ = TimerWheel::Clock::now();
  Problem problem{.status = status, .detail = why};
  if (status == 503) problem.headers.push_back({"Retry-After", "1"});
  Reply reply = problem_reply(problem);
  reply.close = true;
  operation_ = nullptr;
  if (context_.access_log) {
    log_method_.clear();
    log_target_ = label;
  }
  queue(reply);
}

// --- writing -------------------------------------------------------------------------------------

void Connection::queue(Reply reply) {
  if (state_ != State::reading_body) forget_body();
  QueuedReply made(reply.payload, !head_only_);
  const bool refusable = !reply.payload->shared && made.size() > kSmallReply;
  if (refusable && !queue_.pin(made)) {
    loop_.stats().count_rejected("memory");
    const bool close_after = reply.close;
    reply = problem_reply({.status = 503, .detail = kNoMemory, .headers = {{"Retry-After", "1"}}});
    reply.close = close_after;
    made = QueuedReply(reply.payload, !head_only_);
  }
  const bool keep = keep_alive_ && !reply.close && !refused_ && !loop_.farewell;
  closing_ |= !keep;
  linger_ |= reply.close || keep_alive_;  // the client may have sent more, not knowing
  const char digits[3] = {char('0' + reply.status / 100), char('0' + reply.status / 10 % 10),
                          char('0' + reply.status % 10)};
  for (const std::string_view text :
       {std::string_view("HTTP/1.1 "), std::string_view(digits, 3), std::string_view(" "),
        reason(reply.status), std::string_view("\r\n"), std::string_view(loop_.date_line())})
    made.add_line(text);
  if (!keep) {
    made.add_line("Connection: close\r\n");
  } else if (http10_) {
    made.add_line("Connection: keep-alive\r\n");
  }
  if (context_.any_origin) made.add_line("Access-Control-Allow-Origin: *\r\n");
  made.add_more(std::exchange(fields_, {}));
  const double seconds = seconds_since(began_);
  loop_.stats().count_reply(reply.status, seconds);
  const std::size_t body_size = made.body_size();
  queue_.add(std::move(made));
  if (context_.access_log) log_reply(reply, body_size, seconds);
}

void Connection::log_reply(const Reply& reply, std::size_t bytes, double seconds) const {
  const bool refused = log_method_.empty();
  logging::log_access({.method = log_method_,
                       .target = refused ? std::string_view() : log_target_,
                       .refused = refused ? log_target_ : std::string_view(),
                       .status = reply.status,
                       .bytes = bytes,
                       .milliseconds = seconds * 1e3,
                       .client = client(),
                       .request = reply.request_id});
}

/// True when everything has been taken by the socket; else it goes on by itself, or has closed.
bool Connection::flush() {
  while (!queue_.empty()) {
    if (writing_) return false;
    std::array<iovec, ReplyQueue::kMaxRuns> runs;
    msghdr message{};
    message.msg_iov = runs.data();
    message.msg_iovlen = queue_.next(runs);
    const ssize_t sent = ::sendmsg(socket_.native_handle(), &message, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent >= 0) {
      loop_.stats().count_sent(std::size_t(sent));
      written_ += std::size_t(sent);
      queue_.sent(std::size_t(sent));
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      wait_until_writable();
      return false;
    } else if (errno != EINTR) {
      close();
      return false;
    }
  }
  return state_ != State::closed;
}

void Connection::wait_until_writable() {
  if (!queue_.pin_all()) {
    loop_.stats().count_rejected("memory");
    return close();
  }
  writing_ = true;
  socket_.async_wait(boost::asio::ip::tcp::socket::wait_write,
                     [self = shared_from_this()](const auto& error) { self->on_writable(error); });
}

void Connection::on_writable(const boost::system::error_code& error) {
  if (state_ == State::closed) return;
  if (error) return close();
  writing_ = false;
  process();
}

/// What has left this machine's buffers. The socket says "writable" only when a good part of its
/// buffer is free, megabytes on a fast network, which a steady but slow client takes long for.
std::uint64_t Connection::taken_by_client() const {
  int waiting = 0;
  if (::ioctl(const_cast<boost::asio::ip::tcp::socket&>(socket_).native_handle(), SIOCOUTQ,
              &waiting) != 0)
    waiting = 0;
  return written_ - std::min<std::uint64_t>(written_, std::uint64_t(std::max(waiting, 0)));
}

// --- ending --------------------------------------------------------------------------------------

/// Nobody reads from the socket now, but the kernel knows. A client that has closed its own side
/// only may still take an answer: it gets what is done by now, or by then.
void Connection::look_after_client() {
  pollfd look{socket_.native_handle(), POLLRDHUP, 0};
  if (::poll(&look, 1, 0) < 0) look.revents = 0;
  if ((look.revents & (POLLERR | POLLHUP)) != 0) return close();
  if ((look.revents & POLLRDHUP) != 0) {
    gone_.request_stop();  // and there is nothing more to look for
  } else {
    arm_deadline();
  }
}

/// A client that is still sending would get a reset, and lose our last reply: stop writing, read
/// on for a moment, then close.
void Connection::linger() {
  state_ = State::lingering;
  begin_ = end_ = 0;
  boost::system::error_code ignored;
  (void)socket_.shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
  read();
}

void Connection::close() {
  if (state_ == State::closed) return;
  state_ = State::closed;
  gone_.request_stop();
  arm_deadline();  // none
  in_all_.leave();
  in_extra_.leave();
  queue_.clear();
  boost::system::error_code ignored;
  (void)socket_.close(ignored);
  slot_.give_back();
}

}  // namespace tind::http
