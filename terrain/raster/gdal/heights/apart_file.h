#pragma once
// A file that a process of its own opens and reads.

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "terrain/raster/gdal/heights/file_wire.h"
#include "terrain/raster/nodata.h"
#include "terrain/raster/sandbox/team.h"

namespace tind::gdal {

/// The processes for the files of one DEM.
class Crew {
 public:
  static std::shared_ptr<const Crew> of(std::shared_ptr<sandbox::Team>,
                                        std::span<const std::string> files, const DemOptions&);
  ~Crew() { team_->dismiss(id_); }
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  Result<std::unique_ptr<sandbox::Decoder>> take() const { return team_->take(id_, brief_); }
  /// Where it is good for nothing any more it goes.
  void give(std::unique_ptr<sandbox::Decoder>) const;
  const sandbox::TeamOptions& options() const { return team_->options(); }
  const std::string& file(std::size_t i) const { return files_[i]; }
  const DemOptions& dem() const { return dem_; }

 private:
  Crew(std::shared_ptr<sandbox::Team>, std::span<const std::string> files, const DemOptions&);
  const std::shared_ptr<sandbox::Team> team_;
  const std::uint64_t id_;
  const std::vector<std::string> files_;
  const std::string brief_;
  const DemOptions dem_;
};

class ApartFile final : public HeightFile {
 public:
  /// The i-th file of a crew. Fails as RasterFile does; Errc::io also where its process fails.
  static Result<std::unique_ptr<HeightFile>> open(std::shared_ptr<const Crew>, std::size_t i);

  const FileFacts& facts() const override { return facts_; }
  const FileStates& states() const override { return states_; }
  Result<void> read(int col, int row, int cols, int rows, std::span<double> out) const override;
  Result<void> read_posts(std::span<const Post>) const override;
  std::uint64_t customary(std::size_t k) const override { return customary_[k]; }

 private:
  using Place = std::pair<int, int>;  // of the first post that is asked for
  using Clock = std::chrono::steady_clock;
  struct Bad {
    int times = 0;
    Clock::time_point until;
  };
  ApartFile(std::shared_ptr<const Crew> crew, std::size_t i)
      : crew_(std::move(crew)), index_(std::uint32_t(i)), path_(crew_->file(i)) {}

  /// Asks a process of the crew, which has the file open then.
  Result<void> apart(Place, const std::function<Result<void>(sandbox::Decoder&)>& ask) const;
  Result<void> opened_by(sandbox::Decoder&) const;
  Result<void> learn(sandbox::Decoder&);
  Result<OpenedFile> ask_open(sandbox::Decoder&) const;
  Result<void> read_window(sandbox::Decoder&, int col, int row, int cols, int rows, double* out,
                           std::size_t stride) const;
  Result<sandbox::Reply> ask_heights(sandbox::Decoder&, sandbox::Request, std::size_t posts) const;
  Result<void> may_try(Place) const;
  void failed_at(Place) const;
  void done_at(Place) const;

  const std::shared_ptr<const Crew> crew_;
  const std::uint32_t index_;
  const std::string path_;
  FileFacts facts_;
  FileStates states_;
  std::string same_;  // as the process that opened it first said; all others must, too
  mutable std::array<std::atomic<std::uint64_t>, std::size(kCustomaryNodata)> customary_{};
  mutable std::atomic<std::int64_t> looked_at_ = 0;
  mutable std::mutex trying_;
  mutable std::map<Place, Bad> bad_;
};

}  // namespace tind::gdal
