#pragma once
// Asked of every request, on an I/O thread: whose key it shows, whether that may ask this, and
// whether it asks too often. Takes a hash and two look-ups. What a key is never leaves here: not
// into logs, metrics or answers.

#include <atomic>
#include <functional>
#include <memory>

#include "server/http/router.h"
#include "server/services/access/keys.h"
#include "server/services/access/token_bucket.h"

namespace tind::services {

class AccessGate final : public http::Gate {
 public:
  struct Clocks {
    std::function<Nanoseconds()> steady;
    std::function<SystemTime()> system;
  };
  /// Everybody may ask everything. `clocks`: for tests.
  explicit AccessGate(Clocks clocks = {});
  ~AccessGate() override;

  /// From any thread: these rules count from now on. Keys and rates that stay as they
  /// were keep their buckets.
  void set(AccessRules);

  std::optional<http::Reply> refuse(http::Request&, const http::Operation*,
                                    std::string_view dataset) const override;

 private:
  struct State;
  std::optional<http::Reply> take(http::Request&, TokenBucket&, const Rate&,
                                  std::string_view whose) const;

  Clocks clocks_;
  std::atomic<std::shared_ptr<const State>> state_;
  std::atomic<bool> has_rules_{false};  // else nothing more is looked at
};

}  // namespace tind::services
