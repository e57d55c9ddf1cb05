#pragma once
// One PROJ operation for any number of threads. Used only by the files of this folder.

#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "terrain/geo/coordinates.h"

struct PJconsts;  // PROJ's PJ
struct pj_ctx;    // PROJ's PJ_CONTEXT

namespace tind::gdal {

/// A PROJ context, silent and without network, and an operation in it: what one thread needs.
struct Operation {
  pj_ctx* context;
  PJconsts* pj = nullptr;
  const std::string folder;
  /// `grids`: a folder in which it looks for grids before PROJ's own.
  explicit Operation(std::string grids = {});
  ~Operation();
  Operation(const Operation&) = delete;
  Operation& operator=(const Operation&) = delete;
};

/// Copies of an operation, as many as there are threads that use it at once.
class Operations {
 public:
  /// REQUIRES: an operation.
  explicit Operations(std::unique_ptr<Operation> original) : original_(std::move(original)) {}

  /// In place; `heights` are as many as points, or none: then 0, and dropped. NaN where there is no
  /// result. Thread-safe.
  void run(bool forward, std::span<Vec2> points, std::span<double> heights = {}) const;

 private:
  std::unique_ptr<Operation> take() const;
  void give(std::unique_ptr<Operation>) const;

  mutable std::mutex mutex_;
  std::unique_ptr<Operation> original_;  // only ever cloned, under the mutex
  mutable std::vector<std::unique_ptr<Operation>> idle_;
};

}  // namespace tind::gdal
