#include "server/services/datasets/dataset_spec.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glob.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <memory>
#include <set>

#include "terrain/base/edit_distance.h"
#include "terrain/base/lower_extension.h"
#include "terrain/raster/dem_files.h"
#include "terrain/raster/dem_options_text.h"
#include "terrain/store/open/open_store.h"

namespace tind::services {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxName = 64;
constexpr std::string_view kWild = "*?[";
constexpr char kBetweenPaths = '\n';  // of a setting that takes several files

std::string at(const std::string& file, int line) { return fmt::format("{}:{}", file, line); }

// --- paths ---------------------------------------------------------------------------------------

bool is_url(std::string_view text) { return text.find("://") != text.npos; }

/// So that a pattern's folder means only itself.
std::string without_wildcards(const std::string& folder) {
  std::string plain;
  for (const char c : folder) {
    if (kWild.find(c) != kWild.npos || c == '\\') plain += '\\';
    plain += c;
  }
  return plain;
}

/// As a table names it, relative to its file's folder; "@list.txt" is a list of files.
std::string beside(const fs::path& folder, const std::string& text) {
  if (is_url(text)) return text;
  const bool is_list = text.starts_with('@');
  const std::string name = is_list ? text.substr(1) : text;
  if (fs::path(name).is_absolute()) return text;
  const std::string full = (folder / name).lexically_normal().string();
  std::error_code error;
  if (name.find_first_of(kWild) != name.npos && !fs::exists(full, error))
    return without_wildcards(folder.string()) + "/" + name;
  return is_list ? "@" + full : full;
}

// --- values --------------------------------------------------------------------------------------

/// One text, or several of a list.
Result<std::vector<std::string>> texts_of(const TomlValue& value, const std::string& what) {
  const auto bad = [&] { return fail(Errc::invalid_argument, what); };
  if (const std::string* text = value.scalar()) return std::vector{*text};
  if (!value.list()) return bad();
  std::vector<std::string> texts;
  for (const TomlValue& item : *value.list()) {
    if (!item.scalar()) return bad();
    texts.push_back(*item.scalar());
  }
  return texts;
}

Result<std::vector<std::string>> read_files(const TomlValue& value, const fs::path& folder,
                                            const std::string& where) {
  const std::string must = where + ": files must be a list of texts";
  auto files = texts_of(value, must);
  if (!files) return files;
  const auto is_text = [](const TomlValue& item) { return item.is_text; };
  if (value.list() ? !std::ranges::all_of(*value.list(), is_text) : !is_text(value))
    return fail(Errc::invalid_argument, must);
  if (files->empty() || std::ranges::find(*files, "") != files->end())
    return fail(Errc::invalid_argument, where + ": files must name a file at least");
  for (std::string& file : *files) file = beside(folder, file);
  return files;
}

Result<std::string> read_name(const TomlValue& value, const std::string& where) {
  const std::string* const name = value.scalar();
  if (!name || !value.is_text || *name != safe_name(*name))
    return fail(Errc::invalid_argument, where +
                                            ": name must be a text in quotes, 1 to 64 of the "
                                            "letters A-Z a-z 0-9 . _ -, not beginning "
                                            "with a dot");
  return *name;
}

Result<std::string> read_setting(const DatasetSetting& row, const TomlValue& value,
                                 const fs::path& folder, const std::string& where) {
  auto texts = texts_of(value, where + ": " + file_key(row.name) + " must be a plain value");
  if (!texts) return std::unexpected(texts.error());
  if (value.list() && !row.is_list)
    return fail(Errc::invalid_argument, where + ": " + file_key(row.name) + " takes one value");
  for (std::string& text : *texts)
    if (row.is_path || (row.may_be_path && row.may_be_path(text))) text = beside(folder, text);
  std::string text =
      fmt::format("{}", fmt::join(*texts, row.is_path ? std::string(1, kBetweenPaths) : ","));
  DatasetOptions scratch;
  if (auto done = row.set(scratch, text); !done)
    return fail(
        done.error().code,
        fmt::format("{}: {}", where, wrong_value(file_key(row.name), text, done.error().what)));
  return text;
}

std::string list_of(const std::vector<std::string>& texts) {
  std::vector<std::string> all;
  all.reserve(texts.size());
  for (const std::string& text : texts) all.push_back(toml_quoted(text));
  return fmt::format("[{}]", fmt::join(all, ", "));
}

// --- layers --------------------------------------------------------------------------------------

/// Texts of the layer's own, in metres: how far it bends what is below, how exact its tiles are.
constexpr std::string_view kBlend = "blend", kLayerError = "error";

/// Which settings of a dataset can be said of a layer: how its files are read.
bool is_of_layers(const DatasetSetting& row) {
  const auto name = file_key(row.name);
  return name != "to_datum" &&
         std::ranges::any_of(dem_option_texts(),
                             [&](const DemOptionText& text) { return name == text.name; });
}

std::vector<std::string> keys_of_layers() {
  std::vector<std::string> keys = {"name", "files", std::string(kBlend), std::string(kLayerError)};
  for (const DatasetSetting& row : dataset_settings())
    if (is_of_layers(row)) keys.push_back(file_key(row.name));
  return keys;
}

Result<std::string> read_metres(const TomlValue& value, const std::string& where,
                                const std::string& key) {
  const std::string* const text = value.scalar();
  const auto metres = text ? parse_number(*text, 0.0, 1e7) : fail(Errc::invalid_argument, "");
  if (!metres)
    return fail(Errc::invalid_argument,
                fmt::format("{}: {} must be metres, 0 or more", where, key));
  return *text;
}

Result<std::string> read_layer_setting(const std::string& key, const TomlValue& value,
                                       const fs::path& folder, const std::string& where) {
  if (key == kBlend || key == kLayerError) return read_metres(value, where, key);
  const auto row = std::ranges::find(dataset_settings(), key, [](const DatasetSetting& setting) {
    return file_key(setting.name);
  });
  if (row != dataset_settings().end() && is_of_layers(*row))
    return read_setting(*row, value, folder, where);
  if (row != dataset_settings().end())
    return fail(Errc::invalid_argument,
                fmt::format("{}: {} is said of the whole dataset, not of a layer", where, key));
  return fail(Errc::invalid_argument, fmt::format("{}: unknown key {} of a layer{}", where, key,
                                                  did_you_mean(key, keys_of_layers())));
}

Result<LayerTable> read_layer(const TomlValue& value, const std::string& file,
                              const fs::path& folder) {
  LayerTable layer;
  const std::string begin = at(file, value.line);
  if (!value.table())
    return fail(Errc::invalid_argument, begin + ": write a layer as a table, [[dataset.layer]]");
  for (const auto& [key, member] : *value.table()) {
    const std::string where = at(file, member.line);
    if (key == "name") {
      auto name = read_name(member, where);
      if (!name) return std::unexpected(name.error());
      layer.name = std::move(*name);
    } else if (key == "files") {
      auto files = read_files(member, folder, where);
      if (!files) return std::unexpected(files.error());
      layer.files = std::move(*files);
    } else {
      auto text = read_layer_setting(key, member, folder, where);
      if (!text) return std::unexpected(text.error());
      layer.own[key] = std::move(*text);
    }
  }
  if (layer.name.empty() || layer.files.empty())
    return fail(Errc::invalid_argument, begin + ": a layer needs name = \"...\" and files = [...]");
  return layer;
}

/// [[dataset.layer]]
Result<std::vector<LayerTable>> read_layers(const TomlValue& value, const std::string& file,
                                            const fs::path& folder) {
  const std::string where = at(file, value.line);
  if (!value.list() || value.list()->empty())
    return fail(Errc::invalid_argument, where + ": write [[dataset.layer]], with two brackets");
  std::vector<LayerTable> layers;
  for (const TomlValue& item : *value.list()) {
    auto layer = read_layer(item, file, folder);
    if (!layer) return std::unexpected(layer.error());
    if (std::ranges::find(layers, layer->name, &LayerTable::name) != layers.end())
      return fail(Errc::invalid_argument,
                  fmt::format("{}: a second layer {}", at(file, item.line), layer->name));
    layers.push_back(std::move(*layer));
  }
  return layers;
}

std::string print_layer_table(const LayerTable& layer) {
  std::string out = "\n[[dataset.layer]]\nname = " + toml_quoted(layer.name) + "\n";
  out += "files = " + list_of(layer.files) + "\n";
  for (const auto& [key, text] : layer.own) {
    const bool bare = key == kBlend || key == kLayerError;
    out += fmt::format("{} = {}\n", file_key(key), bare ? text : toml_quoted(text));
  }
  return out;
}

std::vector<std::string> keys_of_tables() {
  std::vector<std::string> keys = {"name", "files", "layer"};
  for (const DatasetSetting& row : dataset_settings()) keys.push_back(file_key(row.name));
  return keys;
}

std::vector<std::string> paths_in(const std::string& text) {
  std::vector<std::string> paths;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(kBetweenPaths, begin), text.size());
    paths.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return paths;
}

Result<std::vector<std::string>> fitting(const std::string& pattern) {
  glob_t found{};
  const std::unique_ptr<glob_t, void (*)(glob_t*)> owner(&found, globfree);
  const auto stops = [](const char*, int error) {
    return int(error != ENOENT && error != ENOTDIR);
  };
  // NOLINTNEXTLINE(concurrency-mt-unsafe): it is where it looks for users' homes
  const int code = ::glob(pattern.c_str(), 0, stops, &found);
  if (code == GLOB_NOMATCH) return fail(Errc::not_found, pattern + ": no file fits this pattern");
  if (code != 0) return fail(Errc::io, pattern + ": its folder cannot be read");
  return std::vector<std::string>(found.gl_pathv, found.gl_pathv + found.gl_pathc);
}

/// What letters of Latin scripts are without their accents, from U+00C0 to U+017F.
constexpr std::string_view kWithoutAccents =
    "A A A A A A AE C E E E E I I I I D N O O O O O x O U U U U Y Th ss a a a a a a "
    "ae c e e e e i i i i d n o o o o o _ o u u u u y th y A a A a A a C c C c C c C "
    "c D d D d E e E e E e E e E e G g G g G g G g H h H h I i I i I i I i I i IJ ij "
    "J j K k k L l L l L l L l L l N n N n N n n Ng ng O o O o O o OE oe R r R r R r "
    "S s S s S s S s T t T t T t U u U u U u U u U u U u W w Y y Y Z z Z z Z z s ";
constexpr std::uint32_t kFirstAccent = 0xc0, kLastAccent = 0x17f;
constexpr std::uint32_t kFirstMark = 0x300, kLastMark = 0x36f;

/// The next one of UTF-8; a byte that is none counts as one.
std::string_view take_character(std::string_view& text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  std::size_t size = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : lead >= 0xc0 ? 2 : 1;
  size = std::min(size, text.size());
  for (std::size_t i = 1; i < size; ++i)
    if ((static_cast<unsigned char>(text[i]) & 0xc0) != 0x80) size = 1;
  const std::string_view character = text.substr(0, size);
  text.remove_prefix(size);
  return character;
}

/// A character as names may have it; "_" where there is no such.
std::string_view as_ascii(std::string_view c) {
  const bool fine =
      c.size() == 1 && ((c[0] >= 'a' && c[0] <= 'z') || (c[0] >= 'A' && c[0] <= 'Z') ||
                        (c[0] >= '0' && c[0] <= '9') || c[0] == '.' || c[0] == '_' || c[0] == '-');
  if (fine) return c;
  if (c.size() != 2) return "_";
  const std::uint32_t code = (std::uint32_t(c[0]) & 0x1f) << 6 | (std::uint32_t(c[1]) & 0x3f);
  if (code >= kFirstMark && code <= kLastMark) return "";  // an accent by itself, behind its letter
  if (code < kFirstAccent || code > kLastAccent) return "_";
  std::string_view rest = kWithoutAccents;
  for (std::uint32_t k = kFirstAccent; k < code; ++k) rest.remove_prefix(rest.find(' ') + 1);
  return rest.substr(0, rest.find(' '));
}

}  // namespace

DatasetSpec parse_dataset_spec(const std::string& text) {
  const auto equals = text.find('=');
  if (std::error_code none; equals == text.npos || fs::exists(text, none)) return {{}, {text}};
  DatasetSpec spec{text.substr(0, equals), {}};
  std::string_view rest = std::string_view(text).substr(equals + 1);
  while (!rest.empty()) {
    const std::string_view file = rest.substr(0, rest.find(','));
    if (!file.empty()) spec.files.emplace_back(file);
    rest.remove_prefix(std::min(file.size() + 1, rest.size()));
  }
  return spec;
}

Result<DatasetSpec> read_dataset_table(const TomlValue& value, const std::string& file,
                                       const std::string& name) {
  const std::string begin = at(file, value.line);
  if (!value.table())
    return fail(Errc::invalid_argument, begin + ": write a dataset as a table, [[dataset]]");
  const fs::path folder = fs::absolute(file).parent_path();
  DatasetSpec spec{name, {}, {}, begin};
  std::string files_at;
  for (const auto& [key, member] : *value.table()) {
    const std::string where = at(file, member.line);
    Result<void> done;
    if (key == "name") {
      auto given = read_name(member, where);
      if (!given) return std::unexpected(given.error());
      spec.name = *given;
    } else if (key == "files") {
      auto files = read_files(member, folder, where);
      if (!files) return std::unexpected(files.error());
      spec.files = std::move(*files);
      files_at = where;
    } else if (key == "layer") {
      auto layers = read_layers(member, file, folder);
      if (!layers) return std::unexpected(layers.error());
      spec.layers = std::move(*layers);
    } else {
      const auto row =
          std::ranges::find(dataset_settings(), key,
                            [](const DatasetSetting& setting) { return file_key(setting.name); });
      if (row == dataset_settings().end())
        return fail(Errc::invalid_argument, fmt::format("{}: unknown key {} of a dataset{}", where,
                                                        key, did_you_mean(key, keys_of_tables())));
      auto text = read_setting(*row, member, folder, where);
      if (!text) return std::unexpected(text.error());
      spec.own[row->name] = std::move(*text);
    }
  }
  if (!spec.layers.empty() && !spec.files.empty())
    return fail(Errc::invalid_argument,
                files_at +
                    ": a dataset has either files = [...] or [[dataset.layer]] tables, whose "
                    "files are their own");
  for (const LayerTable& layer : spec.layers)
    spec.files.insert(spec.files.end(), layer.files.begin(), layer.files.end());
  if (spec.files.empty())
    return fail(Errc::invalid_argument,
                begin + ": a dataset without files = [...] and without [[dataset.layer]]");
  return spec;
}

std::string print_dataset_table(const DatasetSpec& spec) {
  std::string out = "\n[[dataset]]\n";
  if (!spec.name.empty()) out += "name = " + toml_quoted(spec.name) + "\n";
  if (spec.layers.empty()) out += "files = " + list_of(spec.files) + "\n";
  for (const auto& [name, text] : spec.own) {
    const DatasetSetting& row = *dataset_setting(name);
    const auto paths = row.is_path ? paths_in(text) : std::vector{text};
    const bool bare = row.is_number || row.is_switch;
    out += fmt::format("{} = {}\n", file_key(name),
                       paths.size() > 1 ? list_of(paths)
                       : bare           ? text
                                        : toml_quoted(text));
  }
  for (const LayerTable& layer : spec.layers) out += print_layer_table(layer);
  return out;
}

namespace {

/// `where`: of a table, whose files may be patterns.
Result<std::vector<std::string>> files_of(const std::vector<std::string>& named_files,
                                          const std::string& table) {
  if (table.empty()) return named_files;
  std::vector<std::string> files;
  std::set<std::string> seen;
  std::error_code error;
  for (const std::string& file : named_files) {
    const bool pattern = file.find_first_of(kWild) != file.npos && !is_url(file) &&
                         !file.starts_with('@') && !fs::exists(file, error);
    auto named = pattern ? fitting(file) : Result<std::vector<std::string>>(std::vector{file});
    if (!named) return fail(table, named.error());
    for (std::string& one : *named)
      if (seen.insert(one).second) files.push_back(std::move(one));
  }
  return files;
}

/// What the layer's texts say besides what is said of all.
Result<void> apply(const LayerTable& layer, LayerSpec& spec, SurfaceOptions& options) {
  DemOptions dem = options.dem;
  for (const auto& [key, text] : layer.own) {
    if (key == kBlend || key == kLayerError) {
      const auto metres = parse_number(text, 0.0, 1e7);
      if (!metres) return fail("layer " + layer.name + ": " + key, metres.error());
      (key == kBlend ? options.blends_m : options.max_errors_m).push_back({layer.name, *metres});
    } else if (auto set = set_dem_option(file_key(key), text, dem); !set) {
      return fail("layer " + layer.name + ": " + key, set.error());
    }
  }
  spec.dem = std::move(dem);
  return {};
}

}  // namespace

Result<std::vector<std::string>> files_of(const DatasetSpec& spec) {
  return files_of(spec.files, spec.where);
}

Result<LayerSpecs> layers_of(const DatasetSpec& spec, const DemOptions& dem) {
  LayerSpecs specs{{}, {.dem = dem}};
  for (const LayerTable& layer : spec.layers) {
    auto files = files_of(layer.files, spec.where);
    if (!files) return std::unexpected(files.error());
    LayerSpec one{layer.name, std::move(*files)};
    if (auto done = apply(layer, one, specs.options); !done) return std::unexpected(done.error());
    specs.layers.push_back(std::move(one));
  }
  return specs;
}

std::string name_of_file(const std::string& path) {
  const fs::path name = fs::path(path).filename();
  return (lower_extension(name.string()) == ".zip" ? name.stem() : name).stem().string();
}

std::string name_of(const DatasetSpec& spec) {
  if (!spec.name.empty()) return spec.name;
  const fs::path path = fs::path(spec.files[0]).lexically_normal();
  const bool slash = !path.has_filename();  // "tiles/"
  if (slash) return path.parent_path().filename().string();
  std::error_code none;
  return fs::is_directory(path, none) ? path.filename().string() : name_of_file(path.string());
}

bool is_stored(const DatasetSpec& spec) {
  if (!spec.layers.empty() || spec.files.size() != 1) return false;
  const std::string& file = spec.files[0];
  if (is_url(file)) return names_store(file);
  std::error_code none;
  return names_archive(file) || (fs::is_directory(file, none) && !is_dem_folder(file));
}

std::string safe_name(std::string_view text) {
  std::string name;
  bool says_anything = false;
  while (!text.empty()) {
    const std::string_view character = take_character(text), as = as_ascii(character);
    if (name.size() + as.size() > kMaxName) break;
    says_anything = says_anything || (!as.empty() && as != "_") || character == "_";
    name += as;
  }
  if (!says_anything) return "dataset";
  if (name[0] == '.') name[0] = '_';
  return name;
}

std::string wrong_value(const std::string& name, const std::string& value,
                        const std::string& what) {
  const bool names_it = !value.empty() && what.find("'" + value) != what.npos;
  return names_it || what.ends_with(value) ? fmt::format("{}: {}", name, what)
                                           : fmt::format("{} {}, not \"{}\"", name, what, value);
}

std::string did_you_mean(std::string_view unknown, const std::vector<std::string>& names) {
  std::string best;
  std::size_t distance = 1 + unknown.size() / 3;
  for (const std::string& name : names) {
    const std::size_t d = edit_distance(unknown, name);
    if (d > distance) continue;
    distance = d;
    best = name;
  }
  return best.empty() ? std::string() : "; did you mean " + best + "?";
}

std::string file_key(std::string name) {
  std::ranges::replace(name, '-', '_');
  return name;
}

}  // namespace tind::services
