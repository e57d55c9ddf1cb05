#include "terrain/raster/gdal/heights/vrt_nesting.h"

#include <cpl_conv.h>
#include <cpl_minixml.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string_view>

#include "terrain/raster/gdal/gdal_setup.h"

namespace tind::gdal {

namespace {

using Xml = std::unique_ptr<CPLXMLNode, decltype([](CPLXMLNode* n) { CPLDestroyXMLNode(n); })>;
constexpr std::string_view kMark = "<VRTDataset";  // by which GDAL knows them, too
constexpr std::size_t kHead = 4096;

/// What stands in the place of a file's name may be a VRT itself, or one with options.
std::string file_of(std::string name) {
  constexpr std::string_view kScheme = "vrt://";
  while (name.starts_with(kScheme)) {
    name.erase(0, kScheme.size());
    name.resize(std::min(name.size(), name.find('?')));
  }
  return name;
}

/// The same file, however its name is spelled.
std::string one_name(const std::string& path) {
  std::error_code error;
  const auto real = std::filesystem::canonical(path, error);
  return error ? path : real.string();
}

bool is_vrt(const std::string& path) {
  std::error_code error;  // a pipe would be waited for
  if (path.starts_with("/vsistdin") ||
      (!path.starts_with("/vsi") && !std::filesystem::is_regular_file(path, error)))
    return false;
  std::array<char, kHead> head;
  VSILFILE* const file = VSIFOpenL(path.c_str(), "rb");
  if (!file) return false;
  const std::size_t n = VSIFReadL(head.data(), 1, head.size(), file);
  VSIFCloseL(file);
  return std::string_view(head.data(), n).contains(kMark);
}

bool exists(const std::string& path) {
  VSIStatBufL stat;
  return VSIStatExL(path.c_str(), &stat, VSI_STAT_EXISTS_FLAG) == 0;
}

std::size_t size_of(const std::string& path) {
  VSIStatBufL stat;
  return VSIStatExL(path.c_str(), &stat, VSI_STAT_SIZE_FLAG) == 0 ? std::size_t(stat.st_size) : 0;
}

/// GDAL's driver for rasters in memory takes an address of this process for a name. Wherever a VRT
/// may have names, none is meant for it.
bool names_memory(const CPLXMLNode* node) {
  for (; node; node = node->psNext)
    if ((node->pszValue && CPLString(node->pszValue).ifind("MEM:::") != std::string::npos) ||
        names_memory(node->psChild))
      return true;
  return false;
}

class Counter {
 public:
  /// Reads of rasters for one read of this.
  Result<long long> reads_of(const std::string& name, int depth) {
    const bool inline_text = name.contains(kMark);
    const std::string path = inline_text ? name : one_name(file_of(name));
    if (const auto known = known_.find(path); known != known_.end()) return known->second;
    if (!inline_text && !is_vrt(path)) {
      ++rasters_;
      return known_[path] = 1;
    }
    const std::string shown = inline_text ? "a VRT within a VRT" : path;
    if (!above_.insert(path).second)
      return fail(Errc::unsupported, shown + ": a VRT that is made of itself");
    if (depth >= kMostVrtDepth)
      return fail(Errc::unsupported,
                  fmt::format("{}: more than {} VRTs above one another; make one of them "
                              "(gdal_translate)",
                              shown, kMostVrtDepth));
    bytes_ += inline_text ? path.size() : size_of(path);
    if (bytes_ > kMostBytes)
      return fail(Errc::unsupported,
                  fmt::format("{}: the VRTs that it names are more than {} MiB; make one raster of "
                              "those below (gdal_translate)",
                              shown, kMostBytes >> 20));
    const Xml xml(inline_text ? CPLParseXMLString(path.c_str()) : CPLParseXMLFile(path.c_str()));
    if (names_memory(xml.get()))
      return fail(Errc::unsupported, shown + ": names memory in place of a file");
    long long sum = 0;
    const std::string folder = inline_text ? std::string() : std::string(CPLGetPath(path.c_str()));
    if (auto ok = add(xml.get(), folder, depth, sum); !ok) return std::unexpected(ok.error());
    const long long distinct = rasters_;
    if (sum > std::max(kFewVrtSources, kMostVrtTimes * distinct))
      return fail(Errc::unsupported,
                  fmt::format("{}: names rasters {} times, of which there are {}, through VRTs "
                              "that name VRTs; make one raster of those below (gdal_translate)",
                              shown, sum, distinct));
    above_.erase(path);
    return known_[path] = sum;
  }

 private:
  /// Elements lie within each other no deeper than GDAL's parser lets them (10,000). As for GDAL,
  /// attributes are elements, cases do not count, and the flag is a number.
  Result<void> add(const CPLXMLNode* node, const std::string& folder, int depth, long long& sum) {
    for (; node; node = node->psNext) {
      if (node->eType != CXT_Element && node->eType != CXT_Attribute) continue;
      if (auto ok = add(node->psChild, folder, depth, sum); !ok) return ok;
      if (!EQUAL(node->pszValue, "SourceFilename") && !EQUAL(node->pszValue, "SourceDataset"))
        continue;
      auto* const named = const_cast<CPLXMLNode*>(node);
      const std::string name = CPLGetXMLValue(named, nullptr, "");
      const std::string beside = CPLProjectRelativeFilename(folder.c_str(), name.c_str());
      // Of an attribute the flag is one of the element around it: what is there is meant.
      const bool relative = std::atoi(CPLGetXMLValue(named, "relativeToVRT", "0")) != 0 ||
                            (!name.contains(kMark) && !exists(name) && exists(beside));
      const auto reads = reads_of(relative ? beside : name, depth + 1);
      if (!reads) return std::unexpected(reads.error());
      sum += *reads;  // fewer of them than bytes in the file, each bounded by rasters_
    }
    return {};
  }

  /// Within an archive one file has many names, each of which is parsed.
  static constexpr std::size_t kMostBytes = std::size_t(512) << 20;

  std::size_t bytes_ = 0;
  long long rasters_ = 0;  // that are none of VRTs
  std::map<std::string, long long> known_;
  std::set<std::string> above_;
};

}  // namespace

Result<void> check_vrt_nesting(const std::string& path) {
  const Complaints silence;
  const auto reads = Counter().reads_of(path, 0);
  if (!reads) return std::unexpected(reads.error());
  return {};
}

}  // namespace tind::gdal
