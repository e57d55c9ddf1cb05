// A record says of what the files are, and that they are ours. It is there before the first of
// them and as long as one is.

#include "terrain/images/image_folder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <sstream>
#include <string_view>
#include <system_error>

#include "terrain/base/file_io.h"
#include "terrain/base/folder_entries.h"
#include "terrain/base/parallel.h"
#include "terrain/store/folder/folder_contents.h"
#include "terrain/store/folder/folder_files.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/store/folder/product_records.h"

namespace tind {
namespace {

namespace fs = std::filesystem;

constexpr int kEpoch = 1;  // to be raised when bytes of images change
constexpr const char* kTiles = "/tiles.json";
constexpr const char* kPartial = ".part";

std::string ending(proto::ImageFormat format) { return "." + name_of(format); }

std::string path_of(web_mercator::Tile t, proto::ImageFormat format) {
  return std::to_string(t.level) + "/" + std::to_string(t.x) + "/" + std::to_string(t.y) +
         ending(format);
}

/// As path_of() writes it, and no other way.
std::optional<std::uint32_t> number(std::string_view text) {
  std::uint32_t n = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
  if (error != std::errc() || end != text.data() + text.size() || std::to_string(n) != text)
    return {};
  return n;
}

/// The tile of "5/31/17".
std::optional<web_mercator::Tile> tile_of(std::string_view z, std::string_view x,
                                          std::string_view y) {
  const auto level = number(z), column = number(x), row = number(y);
  return level && column && row ? web_mercator::tile(*level, *column, *row) : std::nullopt;
}

/// Whose image a file below the folder is by its name, whole or not.
struct NamedTile {
  web_mercator::Tile tile;
  proto::ImageFormat format;
};
std::optional<NamedTile> tile_named(const fs::path& below) {
  const std::vector<fs::path> parts(below.begin(), below.end());
  if (parts.size() != 3) return {};
  std::string name = parts[2].string();
  if (name.ends_with(kPartial)) name.resize(name.size() - std::string_view(kPartial).size());
  const fs::path file = name;
  const std::string word = file.extension().string();
  const auto format = enum_named<proto::ImageFormat>(word.empty() ? word : word.substr(1));
  const auto tile = tile_of(parts[0].string(), parts[1].string(), file.stem().string());
  if (!format || !tile) return {};
  return NamedTile{*tile, *format};
}

constexpr int kAreaLevel = 5;
constexpr const char* kArea = "area";  // "5/31/17 5/0/17 ": of that level, or of the deepest

std::string word(const proto::TileJson& of, std::string_view name) {
  const auto found = std::ranges::find(of.words, name, &std::pair<std::string, std::string>::first);
  return found == of.words.end() ? std::string() : found->second;
}

/// Which tiles of a coarse level there are: bounds around both ends of the map are all of it.
std::string area_of(const ImageSource& source) {
  const int level = std::min(kAreaLevel, source.description.maxzoom);
  std::string text;
  for (const web_mercator::Tile& t : image_tiles(source, level, level))
    text += fmt::format("{}/{}/{} ", t.level, t.x, t.y);
  return text;
}

/// Is one of them the other, or part of it?
bool share(web_mercator::Tile a, web_mercator::Tile b) {
  const int level = std::min(a.level, b.level);
  return a.x >> (a.level - level) == b.x >> (b.level - level) &&
         a.y >> (a.level - level) == b.y >> (b.level - level);
}

/// Can images of that area be in the tile? Of one that is not known or damaged, anywhere.
bool is_in(const std::string& area, web_mercator::Tile tile) {
  std::istringstream words(area);
  bool known = false;
  for (std::string z, x, y;
       std::getline(words, z, '/') && std::getline(words, x, '/') && std::getline(words, y, ' ');) {
    const auto one = tile_of(z, x, y);
    if (!one || share(*one, tile)) return true;
    known = true;
  }
  return !known;
}

/// Can a build with that record have made it?
bool says(const proto::TileJson& record, const NamedTile& t) {
  const auto& [west, south, east, north] = record.bounds;
  return t.tile.level >= record.minzoom && t.tile.level <= record.maxzoom &&
         name_of(t.format) == record.format &&
         web_mercator::rect(t.tile).overlaps({west, south, east, north}) &&
         is_in(word(record, kArea), t.tile);
}

void add_tiles(const ImageSource& source, web_mercator::Tile tile, int first, int last,
               std::vector<web_mercator::Tile>& all) {
  if (tile.level > last || !source.has(tile)) return;
  if (tile.level >= first) all.push_back(tile);
  for (const unsigned south : {0u, 1u})
    for (const unsigned east : {0u, 1u})
      add_tiles(source, {tile.level + 1, 2 * tile.x + east, 2 * tile.y + south}, first, last, all);
}

/// What of a folder below `root`, by its path below it, has a place there. Fails where such a thing
/// is not of that type, a link included, or it cannot be told.
template <class IsPlace>
Result<std::vector<fs::path>> in_place(const std::string& root, const fs::path& folder,
                                       fs::file_type wanted, const IsPlace& is_place) {
  const auto entries = entries_of((fs::path(root) / folder).string());
  if (!entries) return std::unexpected(entries.error());
  std::vector<fs::path> all;
  for (const fs::directory_entry& entry : *entries) {
    const fs::path below = folder / entry.path().filename();
    if (!is_place(below)) continue;
    std::error_code error;
    const auto type = entry.symlink_status(error).type();
    if (error) return folder::cannot_look(entry.path().string(), error);
    if (type != wanted)
      return folder::in_the_way(entry.path().string(), wanted == fs::file_type::directory
                                                           ? "is in the place of a folder of images"
                                                           : "is in the place of an image");
    all.push_back(below);
  }
  return all;
}

/// A word of a record that is ours; of another nothing that a terminal should not have.
std::string printable(const std::string& word) {
  constexpr std::size_t kLongest = 32;
  const bool ours = std::ranges::all_of(word, [](unsigned char c) { return std::isalnum(c); });
  return ours && word.size() <= kLongest ? word : "others";
}

class ImageFolder {
 public:
  ImageFolder(const ImageSource& source, const std::string& name, const ImageFolderOptions& options,
              const Progress& progress)
      : source_(source),
        name_(name),
        options_(options),
        folder_(options.output),
        progress_(progress) {}

  Result<ImageFolderReport> make();

 private:
  const ImageSource& source_;
  const std::string& name_;
  const ImageFolderOptions& options_;
  const std::string folder_;
  const Progress& progress_;
  FolderFiles files_;
  ImageFolderReport report_;
  std::mutex mutex_;  // of the report and the error
  std::optional<Error> first_error_;

  proto::TileJson description() const;
  proto::TileJson record() const;
  bool has(const NamedTile&) const;
  bool makes(const NamedTile&) const;
  Result<void> claim();
  Result<std::vector<std::string>> take_over(const std::string& kept, proto::TileJson& next) const;
  using Which = std::function<bool(const NamedTile&)>;
  Result<std::vector<std::string>> look(const Result<proto::TileJson>& was, const Which& said,
                                        const Which& goes) const;
  Result<void> put(web_mercator::Tile);
  Result<void> put_all(const std::vector<web_mercator::Tile>&);
  bool is_whole(int level) const;
};

proto::TileJson ImageFolder::description() const {
  proto::TileJson json = source_.description;
  json.name = name_;
  json.tiles = "{z}/{x}/{y}" + ending(source_.format);
  json.minzoom = options_.first_level;
  if (options_.last_level >= 0) json.maxzoom = std::min(json.maxzoom, options_.last_level);
  return json;
}

/// Two builds with the same make the same tiles, wherever both have one. Its levels are those that
/// were made.
proto::TileJson ImageFolder::record() const {
  proto::TileJson json = source_.description;
  json.minzoom = description().minzoom, json.maxzoom = description().maxzoom;
  json.accuracy.clear();  // which changes no tile
  json.words.emplace_back("source", source_.version);
  json.words.emplace_back(kArea, area_of(source_));
  json.numbers.emplace_back("epoch", kEpoch);
  return json;
}

/// Does a build of this source with other levels, if not this one, make an image there?
bool ImageFolder::has(const NamedTile& t) const {
  return t.format == source_.format && t.tile.level <= source_.description.maxzoom &&
         source_.has(t.tile);
}

bool ImageFolder::makes(const NamedTile& t) const {
  const proto::TileJson json = description();
  return t.tile.level >= json.minzoom && t.tile.level <= json.maxzoom && has(t);
}

/// What two folders' records differ in, for a person; empty: nothing that tiles depend on.
std::string differences(const Result<proto::TileJson>& was, const proto::TileJson& is) {
  if (!was) return std::string(kImagesRecord + 1) + " in it is damaged";
  // Heights have an encoding, pictures a style.
  const auto shown = [&](const proto::TileJson& of) {
    return of.encoding.empty() ? word(of, "style") : of.encoding;
  };
  std::vector<std::string> all;
  if (shown(*was) != shown(is))
    all.push_back("they are of the kind " + printable(shown(*was)) + ", not " + shown(is));
  const auto surface = [&](const proto::TileJson& of) {
    return word(of, "surface").empty() ? std::string("source") : word(of, "surface");
  };
  if (surface(*was) != surface(is))
    all.push_back("they show the " + printable(surface(*was)) + ", not the " + surface(is));
  if (was->format != is.format)
    all.push_back("they are " + printable(was->format) + ", not " + is.format);
  const auto of = [&](const proto::TileJson& j) {
    return std::string(word(j, "surface") == "mesh" ? "the tiles' meshes" : "the DEM");
  };
  if (of(*was) != of(is)) all.push_back("they are of " + of(*was) + ", not of " + of(is));
  if (word(*was, "source") != word(is, "source"))
    all.push_back("their source is another, has changed or is read with other options");
  const auto words = [](const proto::TileJson& j) {
    auto rest = j.words;
    std::erase_if(rest,
                  [](const auto& one) { return one.first == kArea; });  // older ones have none
    return rest;
  };
  if (all.empty() &&
      (words(*was) != words(is) || was->numbers != is.numbers || was->tile_size != is.tile_size))
    all.push_back("another version of tind made them");
  return fmt::format("{}", fmt::join(all, "; "));
}

/// The folder is new, empty, or ours and of the same; else an error, or with --force made so. What
/// lies where only this build has an image goes, so that none of another's is taken for it.
Result<void> ImageFolder::claim() {
  proto::TileJson next = record();
  const auto kept = read_regular_file(folder_ + kImagesRecord);
  // What cannot be read may be ours: only what is not there says that nothing is.
  if (!kept && kept.error().code != Errc::not_found) return std::unexpected(kept.error());
  const auto fresh = kept ? false : folder::is_unclaimed(folder_, kImagesRecord);
  if (!fresh) return std::unexpected(fresh.error());
  if (!kept && !*fresh)
    return fail(Errc::invalid_argument,
                folder_ +
                    " holds files that tind build did not make as images: move them, or choose "
                    "another directory");
  const auto old = kept ? take_over(*kept, next) : std::vector<std::string>();
  if (!old) return std::unexpected(old.error());
  // From here on nobody takes what lies here for whole.
  if (auto done = files_.remove(folder_ + kTiles); !done) return done;
  for (const std::string& path : *old)
    if (auto done = files_.remove(path); !done) return done;
  folder::remove_empty_folders(folder_, *old);
  for (const char* name : {kImagesRecord, kTiles})
    if (auto done = remove_partials_of(folder_ + name); !done) return done;
  // None may come back under the new record, also of those that a run before this one removed.
  if (auto done = files_.sync_all(folder_); !done) return done;
  return write_whole_file(folder_ + kImagesRecord, proto::encode_tile_json(next));
}

/// Which images are to go before `next` is the record, which is made to say the levels that stay,
/// too. Changes nothing in the folder.
Result<std::vector<std::string>> ImageFolder::take_over(const std::string& kept,
                                                        proto::TileJson& next) const {
  const auto was = proto::decode_tile_json(kept);
  const std::string other = differences(was, next);
  if (!other.empty() && !options_.force)
    return fail(Errc::invalid_argument, fmt::format("{} holds other images ({}): choose another "
                                                    "directory, or add --force to replace them",
                                                    folder_, other));
  const auto said = [&](const NamedTile& t) { return was && says(*was, t); };
  if (!other.empty())
    return look(was, said, [&](const NamedTile& t) { return said(t) || makes(t); });
  const bool more = next.minzoom < was->minzoom || next.maxzoom > was->maxzoom;
  next.minzoom = std::min(next.minzoom, was->minzoom);
  next.maxzoom = std::max(next.maxzoom, was->maxzoom);
  return look(was, said, [&](const NamedTile& t) { return more && !said(t) && makes(t); });
}

/// Paths of the images that go. Fails where something else is in the place of an image or of a
/// folder of them, of this build or of that before: behind a link, old ones would stay and be taken
/// for this build's.
Result<std::vector<std::string>> ImageFolder::look(const Result<proto::TileJson>& was,
                                                   const Which& said, const Which& goes) const {
  std::vector<std::string> old;
  const auto is_place = [&](const fs::path& below) {
    const auto named = tile_named(below);
    return named && (has(*named) || said(*named));  // the quick one first
  };
  const auto is_level = [&](const fs::path& name) {
    const auto z = number(name.string());
    return z && web_mercator::tile(*z, 0, 0) &&
           (int(*z) <= source_.description.maxzoom ||
            (was && int(*z) >= was->minzoom && int(*z) <= was->maxzoom));
  };
  const auto is_column = [&](const fs::path& below) {
    return tile_of(below.parent_path().string(), below.filename().string(), "0").has_value();
  };
  const auto levels = in_place(folder_, {}, fs::file_type::directory, is_level);
  if (!levels) return std::unexpected(levels.error());
  for (const fs::path& level : *levels) {
    const auto columns = in_place(folder_, level, fs::file_type::directory, is_column);
    if (!columns) return std::unexpected(columns.error());
    for (const fs::path& column : *columns) {
      const auto images = in_place(folder_, column, fs::file_type::regular, is_place);
      if (!images) return std::unexpected(images.error());
      for (const fs::path& image : *images)
        if (goes(*tile_named(image))) old.push_back(folder_ + "/" + image.string());
    }
  }
  return old;
}

Result<void> ImageFolder::put(web_mercator::Tile tile) {
  const std::string path = path_of(tile, source_.format);
  const std::string whole = folder_ + "/" + path, partial = whole + kPartial;
  if (const auto there = read_regular_file(whole);
      there && proto::is_whole_image(*there, source_.format)) {
    const std::lock_guard lock(mutex_);
    ++report_.reused, report_.bytes += there->size();
    return {};
  }
  const auto file = source_.file(tile, progress_.stop);
  if (!file) return fail(path, file.error());
  if (auto done = files_.make_folder(fs::path(whole).parent_path().string()); !done) return done;
  if (auto done = files_.write(partial, *file); !done) return done;
  if (auto done = files_.rename(partial, whole); !done) return done;
  const std::lock_guard lock(mutex_);
  ++report_.built, report_.bytes += file->size();
  return {};
}

Result<void> ImageFolder::put_all(const std::vector<web_mercator::Tile>& tiles) {
  std::atomic<bool> give_up = false;
  std::atomic<std::size_t> done = 0;
  parallel_for(tiles.size(), options_.threads, [&](std::size_t i) {
    if (give_up || progress_.stopped()) return;
    if (auto put_one = put(tiles[i]); !put_one) {
      const std::lock_guard lock(mutex_);
      if (!first_error_) first_error_ = put_one.error();
      give_up = true;
    }
    if (const std::size_t n = ++done; n % (tiles.size() / 200 + 1) == 0)
      progress_.at(double(n) / double(tiles.size()));
  });
  if (progress_.stopped())
    return fail(Errc::cancelled, "stopped before all images were written: run again to go on");
  if (first_error_) return std::unexpected(*first_error_);
  return {};
}

/// Of an earlier run with the same record: images have their names when they are whole.
bool ImageFolder::is_whole(int level) const {
  const auto tiles = image_tiles(source_, level, level);
  std::error_code none;
  return !tiles.empty() && std::ranges::all_of(tiles, [&](const web_mercator::Tile& tile) {
    return fs::is_regular_file(
        fs::symlink_status(folder_ + "/" + path_of(tile, source_.format), none));
  });
}

Result<ImageFolderReport> ImageFolder::make() {
  if (auto done = files_.make_folder(folder_); !done) return std::unexpected(done.error());
  const auto lock = FolderLock::take(folder_);
  if (!lock) return std::unexpected(lock.error());
  if (auto done = claim(); !done) return std::unexpected(done.error());
  proto::TileJson json = description();
  const auto tiles = image_tiles(source_, json.minzoom, json.maxzoom);
  report_.tiles = tiles.size();
  if (auto done = put_all(tiles); !done) return std::unexpected(done.error());
  if (auto done = files_.sync_all(folder_); !done) return std::unexpected(done.error());
  while (json.minzoom > 0 && is_whole(json.minzoom - 1)) --json.minzoom;
  while (json.maxzoom < source_.description.maxzoom && is_whole(json.maxzoom + 1)) ++json.maxzoom;
  if (auto done = write_whole_file(folder_ + kTiles, proto::encode_tile_json(json)); !done)
    return std::unexpected(done.error());
  return report_;
}

}  // namespace

std::vector<web_mercator::Tile> image_tiles(const ImageSource& source, int first_level,
                                            int last_level) {
  std::vector<web_mercator::Tile> all;
  add_tiles(source, {0, 0, 0}, first_level, last_level, all);
  return all;
}

Result<ImageFolderReport> write_images(const ImageSource& source, const std::string& name,
                                       const ImageFolderOptions& options,
                                       const Progress& progress) {
  return ImageFolder(source, name, options, progress).make();
}

}  // namespace tind
