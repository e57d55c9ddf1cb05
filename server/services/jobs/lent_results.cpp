#include "server/services/jobs/lent_results.h"

namespace tind::services {

LentResults::Loan LentResults::lend(const Job& job) {
  {
    const std::lock_guard lock(book_->mutex);
    Lent& lent = book_->jobs[job.id];
    lent.client = job.client, lent.bytes = job.bytes;
    ++lent.loans;
  }
  return {book_.get(), [book = book_, id = job.id](const void*) {
            const std::lock_guard lock(book->mutex);
            const auto lent = book->jobs.find(id);
            if (--lent->second.loans == 0) book->jobs.erase(lent);
          }};
}

void LentResults::removed(std::string_view id) {
  const std::lock_guard lock(book_->mutex);
  if (const auto lent = book_->jobs.find(id); lent != book_->jobs.end())
    lent->second.removed = true;
}

std::uint64_t LentResults::bytes_of(std::string_view client) const {
  const std::lock_guard lock(book_->mutex);
  std::uint64_t sum = 0;
  for (const auto& [id, lent] : book_->jobs)
    if (lent.removed && (client.empty() || lent.client == client)) sum += lent.bytes;
  return sum;
}

}  // namespace tind::services
