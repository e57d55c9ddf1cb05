#include "server/http/admission.h"

#include <netinet/in.h>

#include <algorithm>
#include <cstring>

namespace tind::http {
namespace {

constexpr Address kMapped = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};  // ::ffff:0:0/96
constexpr std::size_t kMappedPrefix = 12, kHostPart = 8;

}  // namespace

Address address_of(const sockaddr_storage& from) {
  Address address = kMapped;
  if (from.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(from).sin_addr;
    std::memcpy(address.data() + kMappedPrefix, &v4, sizeof v4);
  } else if (from.ss_family == AF_INET6) {
    const auto& v6 = reinterpret_cast<const sockaddr_in6&>(from).sin6_addr;
    std::memcpy(address.data(), &v6, sizeof v6);
    if (!std::equal(kMapped.begin(), kMapped.begin() + kMappedPrefix, address.begin()))
      std::fill(address.begin() + kHostPart, address.end(), std::uint8_t{0});
  }
  return address;
}

std::size_t Addresses::count(const Address& address) const {
  const std::lock_guard lock(mutex_);
  const auto found = open_.find(address);
  return found == open_.end() ? 0 : found->second;
}

void Addresses::add(const Address& address) {
  const std::lock_guard lock(mutex_);
  ++open_[address];
}

void Addresses::remove(const Address& address) noexcept {
  const std::lock_guard lock(mutex_);
  const auto found = open_.find(address);
  if (found != open_.end() && --found->second == 0) open_.erase(found);
}

}  // namespace tind::http
