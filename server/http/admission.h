#pragma once
// Who is connected: how many in all, and how many from one address.

#include <sys/socket.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <utility>

namespace tind::http {

/// Where a client comes from, as far as it counts as one: an IPv4 address, or the /64 of an IPv6
/// address, of which one host may use any part.
using Address = std::array<std::uint8_t, 16>;
Address address_of(const sockaddr_storage&);

/// Open connections by address. Thread-safe.
class Addresses {
 public:
  std::size_t count(const Address&) const;
  void add(const Address&);
  void remove(const Address&) noexcept;

 private:
  mutable std::mutex mutex_;
  std::map<Address, std::size_t> open_;
};

/// One connection's place in the counts; given back by its destructor, whatever happened to
/// the connection.
class Slot {
 public:
  Slot(Addresses& addresses, const Address& address, std::atomic<std::size_t>& open)
      : addresses_(&addresses), open_(&open), address_(address) {
    addresses.add(address);
    open.fetch_add(1, std::memory_order_relaxed);
  }
  Slot(Slot&& other) noexcept
      : addresses_(std::exchange(other.addresses_, nullptr)),
        open_(other.open_),
        address_(other.address_) {}
  Slot& operator=(Slot&&) = delete;
  ~Slot() { give_back(); }

  void give_back() noexcept {
    if (!addresses_) return;
    std::exchange(addresses_, nullptr)->remove(address_);
    open_->fetch_sub(1, std::memory_order_relaxed);
  }
  const Address& address() const { return address_; }

 private:
  Addresses* addresses_;
  std::atomic<std::size_t>* open_;
  Address address_;
};

}  // namespace tind::http
