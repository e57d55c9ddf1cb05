#include "server/http/reply_queue.h"

#include <gtest/gtest.h>

#include <string>

namespace tind::http {
namespace {

std::string all_of(const ReplyQueue& queue) {
  std::array<iovec, ReplyQueue::kMaxRuns> runs;
  std::string text;
  for (std::size_t i = 0, count = queue.next(runs); i < count; ++i)
    text.append(static_cast<const char*>(runs[i].iov_base), runs[i].iov_len);
  return text;
}

QueuedReply reply_of(const Reply& reply, bool with_body = true) {
  QueuedReply queued(reply.payload, with_body);
  queued.add_line("L\r\n");
  return queued;
}

TEST(ReplyQueue, GoesOnWhereTheSocketStopped) {
  ByteBudget memory(1 << 20);
  ReplyQueue queue(memory, {});
  EXPECT_TRUE(queue.empty());
  QueuedReply interim;
  interim.add_line("first, ");
  interim.add_line("second");
  EXPECT_EQ(interim.size(), 13u);
  EXPECT_EQ(interim.body_size(), 0u);
  queue.add(std::move(interim));
  const Reply reply = make_reply(200, "text/plain", "hello");
  const QueuedReply whole = reply_of(reply), head = reply_of(reply, false);
  EXPECT_EQ(whole.body_size(), 5u);
  EXPECT_EQ(head.body_size(), 0u);
  EXPECT_EQ(head.size() + 5, whole.size());
  queue.add(whole);
  queue.add(head);
  const std::string text = all_of(queue);
  EXPECT_EQ(text.size(), 13 + whole.size() + head.size());
  EXPECT_TRUE(text.starts_with("first, secondL\r\n"));
  for (std::size_t sent = 0; sent < text.size(); ++sent) {
    ASSERT_EQ(all_of(queue), text.substr(sent));
    ASSERT_FALSE(queue.empty());
    queue.sent(1);
  }
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(all_of(queue), "");
}

TEST(ReplyQueue, IsFullByNumberOrByBytesUntilSomeAreSent) {
  ByteBudget memory(1 << 20);
  ReplyQueue queue(memory, {});
  const QueuedReply small = reply_of(make_reply(200, "text/plain", "x"));
  for (std::size_t i = 0; i < ReplyQueue::kMaxReplies; ++i) {
    EXPECT_TRUE(queue.has_room());
    queue.add(small);
  }
  EXPECT_FALSE(queue.has_room());
  queue.sent(small.size());
  EXPECT_TRUE(queue.has_room());
  queue.add(reply_of(make_reply(200, "text/plain", std::string(ReplyQueue::kMaxBytes, 'x'))));
  queue.sent((ReplyQueue::kMaxReplies - 1) * small.size());
  EXPECT_FALSE(queue.has_room()) << "one, of too many bytes";
  queue.clear();
  EXPECT_TRUE(queue.has_room());
}

TEST(ReplyQueue, GivesNoMoreRunsThanFit) {
  ByteBudget memory(1 << 20);
  ReplyQueue queue(memory, {});
  const auto owner = std::make_shared<Payload>();
  owner->bytes = "0123456789";
  std::vector<Piece> pieces(1000, Piece{owner, std::string_view(owner->bytes).substr(3, 2)});
  const Reply reply = make_reply("text/plain", std::move(pieces));
  const QueuedReply queued = reply_of(reply);
  EXPECT_EQ(queued.body_size(), 2000u);
  queue.add(queued);
  std::string text;
  while (!queue.empty()) {
    const std::string part = all_of(queue);
    ASSERT_FALSE(part.empty());
    text += part;
    queue.sent(part.size());
  }
  EXPECT_EQ(text.size(), queued.size());
  EXPECT_TRUE(text.ends_with("343434"));
}

TEST(ReplyQueue, HoldsTheBudgetUntilItIsSentOrGone) {
  ByteBudget memory(10'000);
  const Reply large = make_reply(200, "text/plain", std::string(6000, 'x'));
  const Reply other = make_reply(200, "text/plain", std::string(6000, 'y'));
  {
    ReplyQueue queue(memory, {}), elsewhere(memory, {1});
    queue.add(reply_of(large));
    EXPECT_EQ(memory.held(), 0u) << "a client that reads holds nothing";
    EXPECT_TRUE(queue.pin_all());
    const std::size_t one = memory.held();
    EXPECT_GE(one, 6000u);
    EXPECT_TRUE(queue.pin_all());
    EXPECT_EQ(memory.held(), one) << "once";
    QueuedReply same = reply_of(large), refused = reply_of(other);
    EXPECT_TRUE(elsewhere.pin(same));
    EXPECT_EQ(memory.held(), one) << "what several are sent counts once";
    EXPECT_FALSE(elsewhere.pin(refused));
    EXPECT_EQ(memory.held(), one);
    elsewhere.add(same);
    queue.sent(reply_of(large).size());
    EXPECT_TRUE(queue.empty());
    EXPECT_EQ(memory.held(), one);
  }
  EXPECT_EQ(memory.held(), 0u);
}

TEST(ByteBudget, IsNeverFullOfTheBytesOfAFew) {
  const Address one{1}, two{2}, three{3};
  ByteBudget memory(7000);
  std::size_t ones = 0, twos = 0;
  while (memory.take(one, 1)) ++ones;
  EXPECT_EQ(ones, 5250u) << "three quarters";
  while (memory.take(two, 1)) ++twos;
  EXPECT_EQ(twos, 875u) << "the last eighth is for others";
  for (std::uint8_t i = 10; i < 70; ++i) {
    EXPECT_TRUE(memory.take({i}, 13)) << "a little for whoever comes";
    EXPECT_FALSE(memory.take({i}, 1));
  }
  EXPECT_FALSE(memory.take(three, 1 << 20)) << "more than all";
  for (std::uint8_t i = 10; i < 70; ++i) memory.give_back({i}, 13);
  memory.give_back(one, ones);
  EXPECT_TRUE(memory.take(three, 3000));
  memory.give_back(two, twos);
  memory.give_back(three, 3000);
  EXPECT_EQ(memory.held(), 0u);
}

TEST(ByteBudget, CountsASharedPayloadForWhoeverWasFirst) {
  const Address one{1}, two{2};
  const Reply large = make_reply(200, "text/plain", std::string(9000, 'x'));
  const std::size_t size = large.payload->memory_bytes(), more = size / 10 * 6;
  ByteBudget memory(2 * size);
  EXPECT_TRUE(memory.pin(one, *large.payload));
  EXPECT_TRUE(memory.pin(two, *large.payload));
  memory.unpin(*large.payload);
  EXPECT_EQ(memory.held(), size);
  EXPECT_FALSE(memory.take(one, more)) << "it would have more than three quarters";
  EXPECT_TRUE(memory.take(two, more));
  memory.give_back(two, more);
  memory.unpin(*large.payload);
  EXPECT_EQ(memory.held(), 0u);
}

}  // namespace
}  // namespace tind::http
