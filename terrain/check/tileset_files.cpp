#include "terrain/check/tileset_files.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <vector>

#include "proto/zip.h"
#include "terrain/base/deflate.h"
#include "terrain/base/file_io.h"
#include "terrain/base/file_there.h"

namespace tind {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTileset = "tileset.json";
constexpr std::uint64_t kMostDirectory = 1u << 30;  // of an archive: ten million files

Error too_large(const std::string& name, std::uint64_t bytes) {
  return {Errc::out_of_range, name + ": has " + std::to_string(bytes) +
                                  " bytes; files of 3D Tiles are read up to " +
                                  std::to_string(TilesetFiles::kMostBytes >> 20) + " MiB"};
}

std::string folder_of(const std::string& location) {
  if (fs::path(location).filename() != kTileset) return location;
  const std::string folder = fs::path(location).parent_path().string();
  return folder.empty() ? "." : folder;
}

class FolderFiles3d : public TilesetFiles {
 public:
  explicit FolderFiles3d(std::string folder) : folder_(std::move(folder)) {}

  Result<void> list() {
    std::error_code error;
    const auto unread = [&] {
      return fail(Errc::io, "cannot read " + folder_ + ": " + error.message());
    };
    for (fs::recursive_directory_iterator it(folder_, error), end; !error && it != end;
         it.increment(error)) {
      const fs::path& path = it->path();
      const fs::path ending = path.extension();
      if (path.filename() != kTileset && ending != ".glb" && ending != ".subtree") continue;
      const bool is_file = it->is_regular_file(error);
      if (error) return unread();
      if (!is_file) continue;
      const std::uint64_t size = it->file_size(error);
      if (error) return unread();
      sizes_[path.lexically_relative(folder_).generic_string()] = size;
      bytes_ += size;
    }
    if (error) return unread();
    return {};
  }
  Result<std::string> read(const std::string& name) const override {
    const auto found = sizes_.find(name);
    if (found == sizes_.end()) return fail(Errc::not_found, name + " is not there");
    if (found->second > kMostBytes) return std::unexpected(too_large(name, found->second));
    return read_regular_file(folder_ + "/" + name);
  }

 private:
  const std::string folder_;
};

class Archive3d : public TilesetFiles {
 public:
  Archive3d(std::unique_ptr<std::istream> in, std::uint64_t bytes, std::string path)
      : path_(std::move(path)), in_(std::move(in)) {
    archive_ = true;
    bytes_ = bytes;
  }

  Result<void> list() {
    const std::uint64_t tail = std::min<std::uint64_t>(bytes_, proto::kZipTail);
    const auto end = at(bytes_ - tail, tail);
    if (!end) return std::unexpected(end.error());
    const auto where = proto::find_directory(*end, bytes_);
    if (!where) return fail(path_, where.error());
    if (where->size > kMostDirectory)
      return fail(Errc::out_of_range, path_ + ": its directory has " + std::to_string(where->size) +
                                          " bytes; archives are read to 1 GiB of it");
    const auto directory = at(where->offset, where->size);
    if (!directory) return std::unexpected(directory.error());
    auto entries = proto::decode_directory(*directory);
    if (!entries) return fail(path_, entries.error());
    for (proto::ZipEntry& e : *entries) {
      if (e.name == proto::k3tzIndex)
        index_ = e;
      else
        sizes_[e.name] = e.packed;
      entries_[e.name] = std::move(e);
    }
    return {};
  }

  Result<std::string> read(const std::string& name) const override {
    const auto found = entries_.find(name);
    if (found == entries_.end()) return fail(Errc::not_found, name + " is not there");
    const std::uint64_t larger = std::max(found->second.packed, found->second.size);
    if (larger > kMostBytes) return std::unexpected(too_large(name, larger));
    return unpacked(found->second);
  }

  Result<std::string> wrong_index() const override {
    if (index_.name.empty()) return "there is none";
    if (index_.method != proto::ZipMethod::stored) return "it is packed, which it may not be";
    const std::uint64_t files = entries_.size() - 1;
    if (index_.size != 24 * files)
      return "it is of " + std::to_string(index_.size / 24) + " files, and the archive has " +
             std::to_string(files);
    const auto bytes = unpacked(index_);
    if (!bytes && bytes.error().code == Errc::io) return std::unexpected(bytes.error());
    if (!bytes) return bytes.error().what;
    std::vector<proto::ZipEntry> all;
    for (const auto& [name, entry] : entries_)
      if (name != index_.name) all.push_back(entry);
    return *bytes == proto::encode_3tz_index(all)
               ? ""
               : "it leads to other places than the archive's directory";
  }

 private:
  const std::string path_;
  const std::unique_ptr<std::istream> in_;
  std::map<std::string, proto::ZipEntry> entries_;
  proto::ZipEntry index_;

  Result<std::string> unpacked(const proto::ZipEntry& e) const {
    if (e.method == proto::ZipMethod::stored && e.packed != e.size)
      return fail(Errc::bad_data, e.name + ": is not packed, and says two sizes");
    const auto header = at(e.offset, proto::kZipHeader);
    if (!header) return std::unexpected(header.error());
    const auto before = proto::local_header_size(*header);
    if (!before) return fail(e.name, before.error());
    auto bytes = at(e.offset + *before, e.packed);
    if (!bytes) return std::unexpected(bytes.error());
    if (e.method == proto::ZipMethod::deflated) {
      if (e.size / 1100 > bytes->size())  // more than DEFLATE can
        return fail(Errc::bad_data, e.name + ": says that it is larger than it can be");
      const auto whole = inflate(*bytes, Wrapping::none, e.size);
      if (!whole) return fail(e.name, whole.error());
      bytes->assign(whole->begin(), whole->end());
    }
    if (bytes->size() != e.size || crc32(*bytes) != e.crc)
      return fail(Errc::bad_data, e.name + ": has other bytes than its checksum is of");
    return bytes;
  }

  Result<std::string> at(std::uint64_t place, std::uint64_t size) const {
    if (place > bytes_ || size > bytes_ - place)
      return fail(Errc::bad_data, path_ + ": is cut off, or names bytes beyond its end");
    std::string bytes(size, '\0');
    in_->clear();
    in_->seekg(std::streamoff(place));
    if (!in_->read(bytes.data(), std::streamsize(size)))
      return fail(Errc::io, "cannot read " + path_);
    return bytes;
  }
};

template <class Files>
Result<std::unique_ptr<TilesetFiles>> listed(std::unique_ptr<Files> files) {
  if (auto done = files->list(); !done) return std::unexpected(done.error());
  return std::unique_ptr<TilesetFiles>(std::move(files));
}

}  // namespace

bool names_tileset(const std::string& location) {
  std::error_code none;
  if (location.ends_with(".3tz")) return true;
  const std::string folder = folder_of(location);
  return fs::is_regular_file(folder + "/" + kTileset, none) &&
         !fs::exists(folder + "/layer.json", none);
}

Result<std::unique_ptr<TilesetFiles>> TilesetFiles::open(const std::string& location) {
  if (location.ends_with(".3tz")) {
    std::error_code error;
    const std::uint64_t bytes = fs::file_size(location, error);
    auto in = std::make_unique<std::ifstream>(location, std::ios::binary);
    if (error || !*in) {
      const auto there = is_there(location);
      if (!there) return std::unexpected(there.error());
      return fail(*there ? Errc::io : Errc::not_found, "cannot open " + location);
    }
    return of_archive(std::move(in), bytes, location);
  }
  return listed(std::make_unique<FolderFiles3d>(folder_of(location)));
}

Result<std::unique_ptr<TilesetFiles>> TilesetFiles::of_archive(std::unique_ptr<std::istream> in,
                                                               std::uint64_t bytes,
                                                               const std::string& name) {
  return listed(std::make_unique<Archive3d>(std::move(in), bytes, name));
}

}  // namespace tind
