#include "server/http/reply_queue.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <utility>

namespace tind::http {

template <class F>
void QueuedReply::each(F&& f) const {
  if (!f(std::string_view(line_.data(), line_size_))) return;
  if ((!more_.empty() && !f(std::string_view(more_))) || !payload_) return;
  const std::string_view bytes = payload_->bytes;
  if (!f(bytes.substr(0, with_body_ ? bytes.npos : payload_->head)) || !with_body_) return;
  for (const Piece& piece : payload_->pieces)
    if (!f(piece.bytes)) return;
}

void QueuedReply::add_line(std::string_view text) {
  assert(line_size_ + text.size() <= line_.size());
  std::memcpy(line_.data() + line_size_, text.data(), text.size());
  line_size_ = std::uint8_t(line_size_ + text.size());
}

std::size_t QueuedReply::size() const {
  std::size_t sum = 0;
  each([&](std::string_view bytes) { return sum += bytes.size(), true; });
  return sum;
}

std::size_t QueuedReply::body_size() const {
  return size() - line_size_ - more_.size() - (payload_ ? payload_->head : 0);
}

void ReplyQueue::add(QueuedReply reply) {
  bytes_ += reply.size();
  replies_.push_back(std::move(reply));
}

void ReplyQueue::clear() {
  for (QueuedReply& reply : replies_) unpin(reply);
  replies_.clear();
  bytes_ = sent_ = 0;
}

bool ReplyQueue::pin(QueuedReply& reply) {
  replies_.reserve(replies_.size() + 1);  // once it is pinned, adding it needs no memory
  return pin_now(reply);
}

bool ReplyQueue::pin_now(QueuedReply& reply) {
  if (reply.pinned_ || !reply.payload_) return true;
  if (!memory_.pin(address_, *reply.payload_)) return false;
  std::size_t pinned = 0;
  const auto& pieces = reply.payload_->pieces;
  while (pinned < pieces.size() && memory_.pin(address_, *pieces[pinned].owner)) ++pinned;
  reply.pinned_ = pinned == pieces.size();
  if (reply.pinned_) return true;
  memory_.unpin(*reply.payload_);
  while (pinned > 0) memory_.unpin(*pieces[--pinned].owner);
  return false;
}

void ReplyQueue::unpin(QueuedReply& reply) {
  if (!std::exchange(reply.pinned_, false)) return;
  memory_.unpin(*reply.payload_);
  for (const Piece& piece : reply.payload_->pieces) memory_.unpin(*piece.owner);
}

bool ReplyQueue::pin_all() {
  return std::ranges::all_of(replies_, [this](QueuedReply& reply) { return pin_now(reply); });
}

std::size_t ReplyQueue::next(std::span<iovec, kMaxRuns> runs) const {
  std::size_t count = 0, skip = sent_;
  const auto add = [&](std::string_view bytes) {
    const std::size_t skipped = std::min(skip, bytes.size());
    skip -= skipped;
    if (skipped < bytes.size())
      runs[count++] = {const_cast<char*>(bytes.data()) + skipped, bytes.size() - skipped};
    return count < runs.size();
  };
  for (const QueuedReply& reply : replies_) {
    reply.each(add);
    if (count == runs.size()) break;
  }
  return count;
}

void ReplyQueue::sent(std::size_t bytes) {
  sent_ += bytes;
  std::size_t done = 0;
  for (QueuedReply& reply : replies_) {
    const std::size_t size = reply.size();
    if (sent_ < size) break;
    sent_ -= size;
    bytes_ -= size;
    unpin(reply);
    ++done;
  }
  replies_.erase(replies_.begin(), replies_.begin() + std::ptrdiff_t(done));
}

}  // namespace tind::http
