// What a process says may be a lie, since a raster may have taken it over. So facts must be such as
// RasterFile could have found, files as the system says that they are, heights numbers or voids.
// Wrong heights of its own raster are all that is left to it; those it could have had in its file.

#include "terrain/raster/gdal/heights/apart_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "terrain/raster/dem_files.h"
#include "terrain/raster/gdal/heights/source_pool.h"
#include "terrain/raster/offset_grid.h"
#include "terrain/raster/sandboxed_pool.h"

namespace tind::gdal {
namespace {

using sandbox::Ask;
using sandbox::Decoder;
using sandbox::Reply;
using sandbox::Request;

static_assert(std::size(kCustomaryNodata) == sandbox::kCounters);
constexpr std::size_t kMostBad = 1024;  // places that are remembered
constexpr std::pair<int, int> kOpening{-1, -1};

/// The error that a process found, in its words.
std::unexpected<Error> told(const Decoder& decoder, const Reply& reply) {
  std::string text = decoder.text(reply);
  std::ranges::replace(text, '\0', ' ');
  std::ranges::replace(text, '\n', ' ');
  return fail(Errc(reply.status - 1), std::move(text));
}

}  // namespace

Crew::Crew(std::shared_ptr<sandbox::Team> team, std::span<const std::string> files,
           const DemOptions& options)
    : team_(std::move(team)),
      id_(team_->new_crew()),
      files_(files.begin(), files.end()),
      brief_(brief_text(files, options)),
      dem_(options) {}

std::shared_ptr<const Crew> Crew::of(std::shared_ptr<sandbox::Team> team,
                                     std::span<const std::string> files,
                                     const DemOptions& options) {
  return std::shared_ptr<const Crew>(new Crew(std::move(team), files, options));
}

void Crew::give(std::unique_ptr<Decoder> decoder) const {
  if (!decoder->good()) decoder.reset();
  team_->give(id_, std::move(decoder));
}

// --- places that ended a process -----------------------------------------------------------------

Result<void> ApartFile::may_try(Place place) const {
  const std::lock_guard lock(trying_);
  const auto bad = bad_.find(place);
  if (bad == bad_.end()) return {};
  const auto left = bad->second.until - Clock::now();
  if (left <= Clock::duration::zero()) return {};
  return fail(
      Errc::io,
      fmt::format("{}: the process that decodes it has failed here {} times; it is tried "
                  "again in {} s",
                  path_, bad->second.times, std::chrono::ceil<std::chrono::seconds>(left).count()));
}

void ApartFile::failed_at(Place place) const {
  const auto& options = crew_->options();
  const std::lock_guard lock(trying_);
  if (bad_.size() >= kMostBad && !bad_.contains(place)) bad_.erase(bad_.begin());
  Bad& bad = bad_[place];
  const auto pause = options.first_pause * (1 << std::min(bad.times, 16));
  bad.until = Clock::now() + std::min(pause, options.last_pause);
  ++bad.times;
}

void ApartFile::done_at(Place place) const {
  const std::lock_guard lock(trying_);
  bad_.erase(place);
}

// --- opening -------------------------------------------------------------------------------------

Result<OpenedFile> ApartFile::ask_open(Decoder& decoder) const {
  Request request;
  request.ask = Ask::open;
  request.file = index_;
  const auto reply = decoder.ask(request, crew_->options().open);
  if (!reply) return fail(path_, reply.error());
  if (reply->status != 0) return told(decoder, *reply);
  auto file = read_opened(decoder.text(*reply), path_, crew_->dem());
  if (!file) return fail(path_, decoder.lied());
  if (!same_.empty() && file->same != same_)
    return fail(Errc::io, path_ +
                              ": is not what it was when it was opened, or there are other files "
                              "beside it; start again to read what is there now");
  return file;
}

/// What the process found, and that the files are those that the system knows.
Result<void> ApartFile::learn(Decoder& decoder) {
  for (const std::string& beside : may_come_beside(path_)) states_.expect_none(beside);
  auto file = ask_open(decoder);
  if (!file) return std::unexpected(file.error());
  for (const FileStates::Entry& entry : file->states) {
    if (auto added = states_.add(entry.path); !added) return added;
    if (!states_.entries().back().state.same_content(entry.state))
      return fail(Errc::io, entry.path + ": has changed while it was opened; try again");
  }
  same_ = std::move(file->same);
  facts_ = std::move(file->facts);
  decoder.opened.insert(index_);
  return {};
}

Result<void> ApartFile::opened_by(Decoder& decoder) const {
  if (decoder.opened.contains(index_)) return {};
  if (auto may = may_try(kOpening); !may) return may;
  if (const auto file = ask_open(decoder); !file) return std::unexpected(file.error());
  decoder.opened.insert(index_);
  done_at(kOpening);
  return {};
}

Result<std::unique_ptr<HeightFile>> ApartFile::open(std::shared_ptr<const Crew> crew,
                                                    std::size_t i) {
  std::unique_ptr<ApartFile> file(new ApartFile(std::move(crew), i));
  auto decoder = file->crew_->take();
  if (!decoder) return fail(file->path_, decoder.error());
  const auto learned = file->learn(**decoder);
  file->crew_->give(std::move(*decoder));
  if (!learned) return std::unexpected(learned.error());
  return file;
}

// --- reading -------------------------------------------------------------------------------------

Result<void> ApartFile::apart(Place place, const std::function<Result<void>(Decoder&)>& ask) const {
  if (auto may = may_try(place); !may) return may;
  auto decoder = crew_->take();
  if (!decoder) return fail(path_, decoder.error());
  Place tried = kOpening;
  Result<void> done = opened_by(**decoder);
  if (done) {
    tried = place;
    done = ask(**decoder);
  }
  const bool lost = !(*decoder)->good();
  crew_->give(std::move(*decoder));
  if (lost) failed_at(tried);
  if (done) done_at(place);
  if (auto same = states_.unchanged(); !same) return same;
  return done;
}

/// The heights then lie in the memory.
Result<Reply> ApartFile::ask_heights(Decoder& decoder, Request request, std::size_t posts) const {
  request.file = index_;
  const auto reply = decoder.ask(request, crew_->options().read);
  if (!reply) return fail(path_, reply.error());
  if (reply->status != 0) return told(decoder, *reply);
  for (const std::uint32_t counted : reply->counted)
    if (counted > posts) return fail(path_, decoder.lied());
  const auto looked = std::int64_t(posts);
  if (looked_at_.fetch_add(looked, std::memory_order_relaxed) + looked <= facts_.cols * facts_.rows)
    for (std::size_t k = 0; k < customary_.size(); ++k)
      customary_[k].fetch_add(reply->counted[k], std::memory_order_relaxed);
  return reply;
}

Result<void> ApartFile::read_window(Decoder& decoder, int col, int row, int cols, int rows,
                                    double* out, std::size_t stride) const {
  Request request;
  request.ask = Ask::read;
  request.col = col, request.row = row, request.cols = cols, request.rows = rows;
  const auto reply = ask_heights(decoder, request, std::size_t(cols) * std::size_t(rows));
  if (!reply) return std::unexpected(reply.error());
  const std::byte* from = decoder.shared();
  for (int r = 0; r < rows; ++r, from += std::size_t(cols) * sizeof(double), out += stride) {
    std::memcpy(out, from, std::size_t(cols) * sizeof(double));
    for (int c = 0; c < cols; ++c)
      if (std::isinf(out[c])) return fail(path_, decoder.lied());
  }
  return {};
}

Result<void> ApartFile::read(int col, int row, int cols, int rows, std::span<double> out) const {
  const int wide = std::min(cols, int(sandbox::kWindowPosts));
  const int high = wide > 0 ? std::max(1, int(sandbox::kWindowPosts) / wide) : 1;
  return apart({col, row}, [&](Decoder& decoder) -> Result<void> {
    for (int r = 0; r < rows; r += high)
      for (int c = 0; c < cols; c += wide)
        if (auto ok = read_window(
                decoder, col + c, row + r, std::min(wide, cols - c), std::min(high, rows - r),
                &out[std::size_t(r) * std::size_t(cols) + std::size_t(c)], std::size_t(cols));
            !ok)
          return ok;
    return {};
  });
}

Result<void> ApartFile::read_posts(std::span<const Post> posts) const {
  if (posts.empty()) return {};
  return apart({posts[0].col, posts[0].row}, [&](Decoder& decoder) -> Result<void> {
    for (std::size_t first = 0; first < posts.size(); first += sandbox::kWindowPosts) {
      const auto some = posts.subspan(first, std::min(sandbox::kWindowPosts, posts.size() - first));
      std::byte* to = decoder.shared() + sandbox::kHeightBytes;
      for (const Post& post : some) {
        const std::int32_t place[2] = {post.col, post.row};
        std::memcpy(to, place, sizeof place);
        to += sizeof place;
      }
      Request request;
      request.ask = Ask::posts;
      request.count = std::uint32_t(some.size());
      const auto reply = ask_heights(decoder, request, some.size());
      if (!reply) return std::unexpected(reply.error());
      for (std::size_t i = 0; i < some.size(); ++i) {
        std::memcpy(some[i].height, decoder.shared() + i * sizeof(double), sizeof(double));
        if (std::isinf(*some[i].height)) return fail(path_, decoder.lied());
      }
    }
    return {};
  });
}

}  // namespace tind::gdal

namespace tind {

bool is_offset_grid(const std::string& path, const std::shared_ptr<SourcePool>& pool) {
  const auto own = std::static_pointer_cast<gdal::Pool>(pool);
  if (!own || !own->team) return is_offset_grid(path);
  const auto crew = gdal::Crew::of(own->team, {&path, 1}, {});
  auto decoder = crew->take();
  if (!decoder) return false;  // whoever opens it as a DEM says why
  sandbox::Request request;
  request.ask = sandbox::Ask::grid;
  const auto reply = (*decoder)->ask(request, crew->options().open);
  crew->give(std::move(*decoder));
  return reply && reply->status == 0 && reply->counted[0] == 1;
}

}  // namespace tind
