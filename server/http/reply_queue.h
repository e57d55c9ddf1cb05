#pragma once
// Replies on their way to one client, in order, and what they hold of the server's memory.

#include <sys/uio.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/admission.h"
#include "server/http/byte_budget.h"
#include "server/http/message/reply.h"

namespace tind::http {

/// A reply as it goes out: lines of its own (status, Date, Connection), then the payload, which
/// others may be sending at the same time.
class QueuedReply {
 public:
  QueuedReply() = default;  // an interim response: nothing but its lines
  QueuedReply(std::shared_ptr<const Payload> payload, bool with_body)
      : payload_(std::move(payload)), with_body_(with_body) {}

  /// REQUIRES: the lines fit into 192 bytes.
  void add_line(std::string_view text);
  /// Lines of any length, after those.
  void add_more(std::string lines) { more_ = std::move(lines); }
  /// What is to be sent, bytes.
  std::size_t size() const;
  /// Of them, those of the body.
  std::size_t body_size() const;

 private:
  friend class ReplyQueue;
  /// Calls f(bytes) for each run of them, until it says false.
  template <class F>
  void each(F&& f) const;

  std::array<char, 192> line_ = {};
  std::uint8_t line_size_ = 0;
  std::string more_;
  bool pinned_ = false;  // its payload, in the budget
  std::shared_ptr<const Payload> payload_;
  bool with_body_ = true;
};

/// Of one connection, on its thread. While a client does not read, what it is sent is counted
/// against the budget, were it only because a cache that forgets it does not free it.
class ReplyQueue {
 public:
  static constexpr std::size_t kMaxReplies = 16;            // written with one call
  static constexpr std::size_t kMaxBytes = 256 * 1024;      // before the client must take some
  static constexpr std::size_t kMaxRuns = 4 * kMaxReplies;  // of bytes, in one call

  /// The budget outlives the queue; what is held of it is the client's at this address.
  ReplyQueue(ByteBudget& memory, const Address& address) : memory_(memory), address_(address) {}
  ~ReplyQueue() { clear(); }
  ReplyQueue(const ReplyQueue&) = delete;
  ReplyQueue& operator=(const ReplyQueue&) = delete;

  bool empty() const { return replies_.empty(); }
  /// May more be queued before the client takes some?
  bool has_room() const { return replies_.size() < kMaxReplies && bytes_ < kMaxBytes; }
  void add(QueuedReply reply);
  void clear();

  /// Takes a reply that is about to be added into the budget; false, with nothing taken, where
  /// there is no room.
  bool pin(QueuedReply&);
  /// All that are queued; false where there is no room for one of them.
  bool pin_all();

  /// What is to be sent next, as runs of bytes; how many there are.
  std::size_t next(std::span<iovec, kMaxRuns>) const;
  /// So many bytes of that have been taken by the socket.
  void sent(std::size_t bytes);

 private:
  bool pin_now(QueuedReply&);
  void unpin(QueuedReply&);

  ByteBudget& memory_;
  const Address address_;
  std::vector<QueuedReply> replies_;
  std::size_t bytes_ = 0;  // of the replies
  std::size_t sent_ = 0;   // of the first of them
};

}  // namespace tind::http
