#include "server/services/access/access_gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <mutex>
#include <utility>

#include "server/http/message/problem.h"

namespace tind::services {
namespace {

using http::Operation;
using http::Reply;
using http::Request;
using http::Scope;

constexpr std::size_t kMostAddresses = 65536;
constexpr Nanoseconds kSecond = 1'000'000'000;

/// What is asked with, wherever it stands; empty: nothing.
std::string_view secret_of(const Request& request) {
  if (const auto said = request.head.fields.find("authorization")) {
    constexpr std::string_view kBearer = "bearer ";
    const bool bearer = said->size() > kBearer.size() &&
                        std::ranges::equal(said->substr(0, kBearer.size()), kBearer, {},
                                           [](unsigned char c) { return char(std::tolower(c)); });
    if (bearer) return said->substr(std::min(said->find_first_not_of(' ', 6), said->size()));
  }
  if (const auto said = request.head.fields.find("x-api-key")) return *said;
  return request.key;
}

Reply unauthorized(const Request& request, const char* detail, const char* challenge) {
  return http::problem_reply({.status = 401,
                              .detail = detail,
                              .instance = request.head.target,
                              .headers = {{"WWW-Authenticate", challenge}}});
}

Reply no_key(const Request& request) {
  return unauthorized(request, "This takes a key: Authorization: Bearer KEY, or X-API-Key.",
                      "Bearer realm=\"tind\"");
}

Reply wrong_key(const Request& request, const char* detail) {
  return unauthorized(request, detail, "Bearer realm=\"tind\", error=\"invalid_token\"");
}

Reply forbidden(const Request& request, std::string detail) {
  return http::problem_reply(
      {.status = 403, .detail = std::move(detail), .instance = request.head.target});
}

/// Of a path that names several with commas between, all.
bool sees_all(const http::Access& access, std::string_view names) {
  while (!names.empty()) {
    const std::string_view name = names.substr(0, names.find(','));
    if (!access.sees(name)) return false;
    names.remove_prefix(std::min(name.size() + 1, names.size()));
  }
  return true;
}

std::int64_t seconds_up(Nanoseconds time) { return (time + kSecond - 1) / kSecond; }

bool has(const std::vector<Scope>& scopes, Scope scope) {
  return std::ranges::find(scopes, scope) != scopes.end();
}

/// Why a key does not do for that; empty: it does.
std::string why_not(const Key& key, const http::Access& access, const Operation& operation,
                    std::string_view dataset) {
  if (!has(key.scopes, operation.scope))
    return fmt::format("This takes a key of the scope {}; yours has {}.", name(operation.scope),
                       scopes_text(key.scopes));
  if (!sees_all(access, dataset)) return "The key is not for this dataset.";
  if (dataset.empty() && !key.datasets.empty() && !operation.heeds_access)
    return "This is of all datasets; the key is for some.";
  return {};
}

}  // namespace

/// Of those who show no key.
class AddressBuckets {
 public:
  std::shared_ptr<TokenBucket> of(const std::array<std::uint8_t, 16>& address, Nanoseconds now) {
    const std::lock_guard lock(mutex_);
    if (const auto found = buckets_.find(address); found != buckets_.end()) return found->second;
    if (buckets_.size() >= kMostAddresses && now - swept_ >= kSecond) {
      std::erase_if(buckets_, [&](const auto& one) { return one.second->is_full(now); });
      swept_ = now;
    }
    if (buckets_.size() >= kMostAddresses) return others_;
    return buckets_[address] = std::make_shared<TokenBucket>();
  }

 private:
  std::mutex mutex_;
  std::map<std::array<std::uint8_t, 16>, std::shared_ptr<TokenBucket>> buckets_;
  std::shared_ptr<TokenBucket> others_ = std::make_shared<TokenBucket>();
  Nanoseconds swept_ = 0;
};

struct AccessGate::State {
  AccessRules rules;
  /// As the keys: what a request with it gets, and how often it may come.
  std::vector<std::shared_ptr<const http::Access>> access;
  std::vector<std::shared_ptr<TokenBucket>> buckets;
  std::shared_ptr<AddressBuckets> addresses;
};

AccessGate::AccessGate(Clocks clocks) : clocks_(std::move(clocks)) {
  using namespace std::chrono;
  if (!clocks_.steady)
    clocks_.steady = [] {
      return Nanoseconds(nanoseconds(steady_clock::now().time_since_epoch()).count());
    };
  if (!clocks_.system) clocks_.system = [] { return floor<seconds>(system_clock::now()); };
  set({});
}

AccessGate::~AccessGate() = default;

void AccessGate::set(AccessRules rules) {
  const auto old = state_.load();
  auto state = std::make_shared<State>();
  for (const Key& key : rules.keys) {
    state->access.push_back(
        std::make_shared<const http::Access>(http::Access{key.name, key.datasets}));
    auto bucket = std::make_shared<TokenBucket>();
    for (std::size_t k = 0; old && k < old->rules.keys.size(); ++k)
      if (old->rules.keys[k].hash == key.hash && old->rules.keys[k].rate == key.rate)
        bucket = old->buckets[k];
    state->buckets.push_back(std::move(bucket));
  }
  state->addresses = old && old->rules.per_address == rules.per_address
                         ? old->addresses
                         : std::make_shared<AddressBuckets>();
  const bool any = !rules.keys.empty() || rules.per_address.per_second > 0;
  state->rules = std::move(rules);
  state_.store(std::move(state));
  has_rules_.store(any, std::memory_order_release);
}

/// The fields of draft-ietf-httpapi-ratelimit-headers-10.
std::optional<Reply> AccessGate::take(Request& request, TokenBucket& bucket, const Rate& rate,
                                      std::string_view whose) const {
  const Taken taken = bucket.take(rate, clocks_.steady());
  const double burst = rate.most_at_once();
  request.fields += fmt::format(
      "RateLimit-Policy: \"{}\";q={:.0f};w={}\r\nRateLimit: \"{}\";r={};t={}\r\n"
      "Access-Control-Expose-Headers: RateLimit, RateLimit-Policy, Retry-After\r\n",
      whose, burst, seconds_up(Nanoseconds(burst / rate.per_second * 1e9)), whose, taken.left,
      seconds_up(taken.again));
  if (taken.passed) return std::nullopt;
  const std::string again = std::to_string(std::max<std::int64_t>(1, seconds_up(taken.again)));
  return http::problem_reply(
      {.status = 429,
       .detail = fmt::format("At most {:g} requests a second, {:.0f} at once; try again in {} s.",
                             rate.per_second, burst, again),
       .instance = request.head.target,
       .headers = {{"Retry-After", again}}});
}

std::optional<Reply> AccessGate::refuse(Request& request, const Operation* operation,
                                        std::string_view dataset) const {
  if (!has_rules_.load(std::memory_order_acquire)) return std::nullopt;
  if (operation && operation->scope == Scope::open) return std::nullopt;
  const auto state = state_.load();
  const AccessRules& rules = state->rules;
  const std::string_view secret = rules.keys.empty() ? std::string_view() : secret_of(request);
  const Key* key = secret.empty() ? nullptr : find_key(rules.keys, secret);
  const bool expired = key && key->expires && clocks_.system() >= *key->expires;
  if (key && !expired) {
    const auto k = std::size_t(key - rules.keys.data());
    request.access = state->access[k];
    if (key->rate.per_second > 0)
      if (auto reply = take(request, *state->buckets[k], key->rate, "key")) return reply;
  } else if (rules.per_address.per_second > 0) {
    const auto bucket = state->addresses->of(request.from, clocks_.steady());
    if (auto reply = take(request, *bucket, rules.per_address, "address")) return reply;
  }
  if (rules.keys.empty() || !operation) return std::nullopt;
  if (expired) return wrong_key(request, "The key has expired.");
  if (!key && !secret.empty()) return wrong_key(request, "There is no such key.");
  if (!key && has(rules.without_a_key, operation->scope)) return std::nullopt;
  if (!key) return no_key(request);
  const bool is_everybodys = has(rules.without_a_key, operation->scope);
  const std::string why = why_not(*key, *request.access, *operation, dataset);
  if (!why.empty() && !is_everybodys) return forbidden(request, why);
  if (!why.empty()) request.access = nullptr;  // a key takes nothing away
  // A cache that many share would give it to those without a key: the strictest word counts.
  if (!is_everybodys) request.fields += "Cache-Control: private\r\n";
  return std::nullopt;
}

}  // namespace tind::services
