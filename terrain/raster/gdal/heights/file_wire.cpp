#include "terrain/raster/gdal/heights/file_wire.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <system_error>

#include "terrain/base/folder_entries.h"
#include "terrain/base/lower_case.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/heights/height_band.h"
#include "terrain/raster/sandbox/wire.h"

namespace tind::gdal {
namespace {

namespace fs = std::filesystem;
using sandbox::Reader;
using sandbox::Writer;

constexpr std::size_t kMostText = 128 << 10, kMostPath = 8192, kMostFiles = 4096;
constexpr std::size_t kMostNumbers = 64;

void put(Writer& to, const std::vector<double>& numbers) {
  to.put(std::uint32_t(numbers.size()));
  for (const double number : numbers) to.put(number);
}

std::vector<double> numbers(Reader& from, std::size_t most = kMostNumbers) {
  std::vector<double> all(from.count(sizeof(double), most));
  for (double& number : all) number = from.number<double>();
  return all;
}

void put(Writer& to, const std::optional<double>& number) {
  to.put(std::uint8_t(number.has_value()));
  to.put(number.value_or(0));
}

std::optional<double> optional_number(Reader& from) {
  const bool there = from.flag();
  const auto number = from.number<double>();
  return there ? std::optional(number) : std::nullopt;
}

void put(Writer& to, const VerticalDatum& datum) {
  to.put(std::uint8_t(datum.kind()));
  to.put(datum.text());
}

VerticalDatum datum(Reader& from) {
  const auto kind = from.number<std::uint8_t>();
  auto text = from.text(kMostText);
  return {VerticalDatum::Kind(std::min<std::uint8_t>(kind, VerticalDatum::file)), std::move(text)};
}

void put(Writer& to, const Affine& a) {
  for (const double number : {a.x0, a.x_col, a.x_row, a.y0, a.y_col, a.y_row}) to.put(number);
}

Affine affine(Reader& from) {
  Affine a;
  for (double* number : {&a.x0, &a.x_col, &a.x_row, &a.y0, &a.y_col, &a.y_row})
    *number = from.number<double>();
  return a;
}

void put(Writer& to, const CrsFacts& crs) {
  to.put(std::uint8_t(crs.kind));
  to.put(crs.wkt);
  to.put(crs.name);
  to.put(crs.unit_m);
  to.put(crs.turn);
  to.put(std::uint8_t(crs.plain_wgs84));
  put(to, crs.datum);
  to.put(crs.vertical);
  to.put(crs.vertical_unit_m);
  to.put(std::uint8_t(crs.downwards));
}

CrsFacts crs(Reader& from, bool& good) {
  CrsFacts crs;
  const auto kind = from.number<std::uint8_t>();
  good = good && kind <= std::uint8_t(CrsKind::projected);
  crs.kind = good ? CrsKind(kind) : CrsKind::none;
  crs.wkt = from.text(kMostText);
  crs.name = from.text(kMostText);
  crs.unit_m = from.number<double>();
  crs.turn = from.number<double>();
  crs.plain_wgs84 = from.flag();
  crs.datum = datum(from);
  crs.vertical = from.text(kMostText);
  crs.vertical_unit_m = from.number<double>();
  crs.downwards = from.flag();
  return crs;
}

/// PROJ takes files and pipelines for names of systems, too; what a raster says is WKT.
bool is_wkt(const std::string& text) {
  const auto bracket = text.find('[');
  return bracket != text.npos && bracket > 0 &&
         std::all_of(text.begin(), text.begin() + std::ptrdiff_t(bracket),
                     [](char c) { return c >= 'A' && c <= 'Z'; });
}

bool is_sound(const CrsFacts& crs) {
  const bool has_crs = crs.kind != CrsKind::none;
  return (!has_crs || is_wkt(crs.wkt)) && std::isfinite(crs.unit_m) && crs.unit_m > 0 &&
         std::isfinite(crs.turn) && crs.turn >= 0 && std::isfinite(crs.vertical_unit_m) &&
         crs.datum.kind() != VerticalDatum::file;
}

/// A raster's system may name no file; one that the operator named may have grids of his.
bool is_its_crs(const FileFacts& facts, const DemOptions& options) {
  if (!names_a_file(facts.crs.wkt)) return true;
  if (options.crs.empty()) return false;
  const auto named = crs_named(options.crs);
  return named && named->wkt == facts.crs.wkt;
}

bool is_sound(const Affine& a) {
  for (const double number : {a.x0, a.x_col, a.x_row, a.y0, a.y_col, a.y_row})
    if (!std::isfinite(number)) return false;
  const double area = a.x_col * a.y_row - a.x_row * a.y_col;
  return std::isfinite(area) && area != 0;
}

bool is_driver(const std::string& name) {
  for (const char* const* one = raster_drivers(true, ".bil"); *one; ++one)
    if (name == *one) return true;
  return false;
}

bool is_sound(const FileFacts& facts) {
  const RasterContent& content = facts.content;
  const auto side = [](std::int64_t n) { return n >= 1 && n <= kRasterLimits.max_side; };
  const auto finite = [](double x) { return std::isfinite(x); };
  return is_driver(facts.driver) && side(facts.cols) && side(facts.rows) &&
         (!facts.has_geotransform || is_sound(facts.post_to_crs)) && is_sound(facts.crs) &&
         finite(facts.z_unit_m) && facts.z_unit_m > 0 && content.band >= 1 && content.bands >= 1 &&
         finite(content.scale) && finite(content.offset) && finite(content.unit_m);
}

void put(Writer& to, const RasterContent& content) {
  to.put(content.type);
  to.put(std::int32_t(content.band));
  to.put(std::int32_t(content.bands));
  to.put(std::uint8_t(content.encoding));
  to.put(content.scale);
  to.put(content.offset);
  to.put(content.unit_m);
  put(to, content.nodata);
  to.put(std::uint8_t(content.mask));
}

HeightEncoding encoding(Reader& from) {
  return HeightEncoding(
      std::min<std::uint8_t>(from.number<std::uint8_t>(), std::uint8_t(HeightEncoding::terrarium)));
}

RasterContent content(Reader& from) {
  RasterContent content;
  content.type = from.text(kMostText);
  content.band = from.number<std::int32_t>();
  content.bands = from.number<std::int32_t>();
  content.encoding = encoding(from);
  content.scale = from.number<double>();
  content.offset = from.number<double>();
  content.unit_m = from.number<double>();
  content.nodata = numbers(from);
  content.mask = from.flag();
  return content;
}

void put(Writer& to, const FileStates::Entry& entry) {
  to.put(entry.path);
  for (const std::uint64_t n : {entry.state.device, entry.state.inode, entry.state.size}) to.put(n);
  to.put(entry.state.written_ns);
}

FileStates::Entry state(Reader& from) {
  FileStates::Entry entry;
  entry.path = from.text(kMostPath);
  for (std::uint64_t* n : {&entry.state.device, &entry.state.inode, &entry.state.size})
    *n = from.number<std::uint64_t>();
  entry.state.written_ns = from.number<std::int64_t>();
  return entry;
}

fs::path whole(const std::string& path) {
  std::error_code error;
  return fs::absolute(path, error).lexically_normal();
}

}  // namespace

std::string brief_text(std::span<const std::string> files, const DemOptions& options) {
  Writer to;
  to.put(std::uint32_t(::getpid()));
  to.put(std::uint32_t(files.size()));
  for (const std::string& file : files) to.put(file);
  put(to, options.from_datum);
  put(to, options.nodata);
  to.put(std::uint8_t(options.ignore_declared_nodata));
  to.put(options.crs);
  to.put(std::int32_t(options.band));
  to.put(std::uint8_t(options.encoding));
  put(to, options.scale);
  put(to, options.offset);
  to.put(std::uint8_t(options.allow_vrt));
  to.put(std::uint8_t(options.keep_source_units));
  return to.bytes();
}

Result<Brief> read_brief(std::string_view bytes) {
  Reader from(bytes);
  Brief brief;
  brief.parent = from.number<std::uint32_t>();
  brief.files.resize(from.count(sizeof(std::uint32_t), bytes.size()));
  for (std::string& file : brief.files) file = from.text(bytes.size());
  DemOptions& options = brief.options;
  options.from_datum = datum(from);
  options.nodata = numbers(from, bytes.size());
  options.ignore_declared_nodata = from.flag();
  options.crs = from.text(bytes.size());
  options.band = from.number<std::int32_t>();
  options.encoding = encoding(from);
  options.scale = optional_number(from);
  options.offset = optional_number(from);
  options.allow_vrt = from.flag();
  options.keep_source_units = from.flag();
  if (!from.done()) return fail(Errc::bad_data, "nobody said what is to be decoded");
  return brief;
}

std::string opened_text(const HeightFile& file) {
  const FileFacts& facts = file.facts();
  Writer to;
  to.put(facts.driver);
  to.put(facts.cols);
  to.put(facts.rows);
  to.put(std::uint8_t(facts.has_geotransform));
  put(to, facts.post_to_crs);
  put(to, facts.crs);
  to.put(facts.own_crs);
  to.put(facts.z_unit_m);
  to.put(std::uint8_t(facts.exact));
  put(to, facts.content);
  const auto states = file.states().entries();
  to.put(std::uint32_t(states.size()));
  for (const FileStates::Entry& entry : states) put(to, entry);
  return to.bytes();
}

Result<OpenedFile> read_opened(std::string_view bytes, const std::string& path,
                               const DemOptions& options) {
  Reader from(bytes);
  OpenedFile file;
  FileFacts& facts = file.facts;
  bool good = true;
  facts.path = path;
  facts.driver = from.text(kMostText);
  facts.cols = from.number<std::int64_t>();
  facts.rows = from.number<std::int64_t>();
  facts.has_geotransform = from.flag();
  facts.post_to_crs = affine(from);
  facts.crs = crs(from, good);
  facts.own_crs = from.text(kMostText);
  facts.z_unit_m = from.number<double>();
  facts.exact = from.flag();
  facts.content = content(from);
  file.states.resize(from.count(4 * sizeof(std::uint64_t), kMostFiles));
  for (FileStates::Entry& entry : file.states) entry = state(from);
  good = good && from.done() && is_sound(facts) && is_its_crs(facts, options) &&
         !file.states.empty() && file.states[0].path == path;
  for (std::size_t i = 1; good && i < file.states.size(); ++i)
    good = options.allow_vrt || belongs_to(path, file.states[i].path);
  if (!good) return fail(Errc::bad_data, "not what a file can be");
  Writer same;
  same.put(facts.driver);
  same.put(facts.cols);
  same.put(facts.rows);
  for (const FileStates::Entry& entry : file.states) put(same, entry);
  file.same = same.bytes();
  return file;
}

bool belongs_to(const std::string& raster, const std::string& other) {
  const fs::path a = whole(raster), b = whole(other);
  if (a == b) return true;
  return a.parent_path() == b.parent_path() &&
         lower_case(b.filename().string()).starts_with(lower_case(a.stem().string()) + ".");
}

Result<std::vector<std::string>> files_of_rasters(std::span<const std::string> rasters) {
  using Names = std::multimap<std::string, fs::path>;  // in small letters
  std::map<fs::path, Names> folders;
  std::vector<std::string> found;
  for (const std::string& raster : rasters) {
    const fs::path path = whole(raster);
    found.push_back(path.string());
    auto [folder, is_new] = folders.try_emplace(path.parent_path());
    if (is_new) {
      const auto entries = entries_of(folder->first.string());
      std::error_code ignored;
      const auto type = fs::status(folder->first, ignored).type();
      // Where there is no such folder, there is no such raster either, which is said later.
      if (!entries && (type == fs::file_type::directory || type == fs::file_type::none))
        return std::unexpected(entries.error());
      if (entries)
        for (const fs::directory_entry& one : *entries)
          folder->second.emplace(lower_case(one.path().filename().string()), one.path());
    }
    const std::string stem = lower_case(path.stem().string()) + ".";
    for (auto one = folder->second.lower_bound(stem);
         one != folder->second.end() && one->first.starts_with(stem); ++one)
      found.push_back(one->second.string());
  }
  return found;
}

}  // namespace tind::gdal
