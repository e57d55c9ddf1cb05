#pragma once
// One limit for all bytes that the server holds for single clients: request bodies, responses made
// for one client, and what clients that read slowly keep from being forgotten.

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <unordered_map>

#include "server/http/admission.h"
#include "server/http/message/reply.h"

namespace tind::http {

/// Thread-safe. What was taken is given back by whoever took it, for the same address. No address
/// may hold more than three times what is left for the others (one alone has three quarters at
/// most), and the last eighth is for those who hold little: a 512th of all each, so that a few who
/// take what they get leave room for some sixty more.
class ByteBudget {
 public:
  explicit ByteBudget(std::size_t limit) : limit_(limit) {}
  ByteBudget(const ByteBudget&) = delete;
  ByteBudget& operator=(const ByteBudget&) = delete;

  /// False, and nothing taken, when there is no room.
  bool take(const Address&, std::size_t bytes);
  void give_back(const Address&, std::size_t bytes) noexcept;

  /// The same for a payload, which counts once however many connections pin it: for whoever was the
  /// first, until the last has let it go.
  bool pin(const Address&, const Payload&);
  void unpin(const Payload&) noexcept;

  std::size_t held() const;
  std::size_t limit() const { return limit_; }

 private:
  struct Pin {
    std::size_t count = 0;
    Address holder{};
  };
  bool take_now(const Address&, std::size_t bytes);
  void give_back_now(const Address&, std::size_t bytes) noexcept;

  const std::size_t limit_;
  mutable std::mutex mutex_;  // of all that follow
  std::size_t held_ = 0;
  std::map<Address, std::size_t> holders_;  // none that holds nothing
  std::unordered_map<const Payload*, Pin> pins_;
};

}  // namespace tind::http
