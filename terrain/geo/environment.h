#pragma once
// What an installation brings along, found once by whoever starts (main, a test) and passed to what
// needs it: this library looks for nothing by itself.

#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "terrain/base/result.h"
#include "terrain/geo/geoid.h"

namespace tind {

/// Thread-safe; shared by everything that was made with it.
class Environment {
 public:
  /// `data_dir`: share/tind of the installation, with geoids/ and viewer/. Nothing is read yet.
  explicit Environment(std::string data_dir) : data_dir_(std::move(data_dir)) {}
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

  const std::string& data_dir() const { return data_dir_; }

  /// EGM96 of data_dir/geoids, loaded at the first call and kept. The error (not_found) names the
  /// script that makes the file.
  Result<std::shared_ptr<const Geoid>> egm96() const;

 private:
  const std::string data_dir_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const Geoid> egm96_;
};

}  // namespace tind
