#pragma once
// Results that clients are being sent. A file that is removed meanwhile keeps its place on the disk
// until the last of them has it or is gone: it counts as stored for as long.

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "server/services/jobs/job.h"

namespace tind::services {

/// Thread-safe, and may be gone before what it has lent comes back.
class LentResults {
 public:
  using Loan = std::shared_ptr<const void>;
  /// For as long as somebody has any of the job's files open.
  Loan lend(const Job&);
  /// The files of that job have no name any more.
  void removed(std::string_view id);
  /// What removed ones still take, at most; of one client, or of all.
  std::uint64_t bytes() const { return bytes_of({}); }
  std::uint64_t bytes_of(std::string_view client) const;

 private:
  struct Lent {
    std::string client;
    std::uint64_t bytes = 0;
    int loans = 0;
    bool removed = false;
  };
  struct Book {
    std::mutex mutex;
    std::map<std::string, Lent, std::less<>> jobs;  // by id
  };
  const std::shared_ptr<Book> book_ = std::make_shared<Book>();
};

}  // namespace tind::services
