// A byte a pixel: which of the classes it is. There are few, whatever their numbers.

#include "terrain/raster/land_cover.h"

#include <cpl_minixml.h>
#include <gdal_rat.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "terrain/base/file_io.h"
#include "terrain/base/hash.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/pictures/placed_raster.h"

namespace tind {
namespace {

constexpr int kLongestSide = 16384;  // pixels that are kept
constexpr std::uint8_t kNone = 255;  // where there is no class
constexpr std::size_t kMostClasses = kNone;
constexpr int kLargestNumber = 65535;

struct Classes {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
  std::vector<int> numbers;  // of the classes, in the order of their coming
};

/// Reads a band line by line. Overviews are left alone: nobody knows how they were made.
class Reader {
 public:
  explicit Reader(GDALRasterBand& band)
      : band_(band),
        line_(std::size_t(band.GetXSize())),
        valid_(band.GetMaskFlags() & GMF_ALL_VALID ? 0 : line_.size()) {
    const double most = std::max(band.GetXSize(), band.GetYSize());
    const double kept = std::min(1.0, kLongestSide / most);
    out_.width = std::max(1, int(std::lround(band.GetXSize() * kept)));
    out_.height = std::max(1, int(std::lround(band.GetYSize() * kept)));
    out_.pixels.reserve(std::size_t(out_.width) * std::size_t(out_.height));
  }

  Result<Classes> read() {
    for (int row = 0; row < out_.height; ++row) {
      if (auto done = read_line(from(row, out_.height, band_.GetYSize())); !done)
        return std::unexpected(done.error());
      for (int col = 0; col < out_.width; ++col)
        if (auto taken = take(std::size_t(from(col, out_.width, band_.GetXSize()))); !taken)
          return std::unexpected(taken.error());
    }
    return std::move(out_);
  }

 private:
  GDALRasterBand& band_;
  std::vector<std::int32_t> line_;
  std::vector<std::uint8_t> valid_;  // empty: all of it
  std::vector<std::uint8_t> known_ = std::vector<std::uint8_t>(kLargestNumber + 1, kNone);
  Classes out_;

  /// The pixel of the file in whose middle the kept one is.
  static int from(int kept, int of_kept, int of_file) {
    return int((2 * std::int64_t(kept) + 1) * of_file / (2 * std::int64_t(of_kept)));
  }

  Result<void> read_line(int row) {
    const gdal::Complaints complaints;
    const int width = band_.GetXSize();
    bool good = band_.RasterIO(GF_Read, 0, row, width, 1, line_.data(), width, 1, GDT_Int32, 0, 0,
                               nullptr) == CE_None;
    if (good && !valid_.empty())
      good = band_.GetMaskBand()->RasterIO(GF_Read, 0, row, width, 1, valid_.data(), width, 1,
                                           GDT_Byte, 0, 0, nullptr) == CE_None;
    if (good && !complaints.failed()) return {};
    return complaints.no_pixels();
  }

  Result<void> take(std::size_t col) {
    if (!valid_.empty() && valid_[col] == 0) {
      out_.pixels.push_back(kNone);
      return {};
    }
    const int number = line_[col];
    if (number < 0 || number > kLargestNumber)
      return fail(Errc::bad_data, "a pixel is " + std::to_string(number) +
                                      ", and numbers of classes are 0 to 65535; if it means no "
                                      "data, declare it (gdal_translate -a_nodata)");
    std::uint8_t& known = known_[std::size_t(number)];
    if (known == kNone) {
      if (out_.numbers.size() == kMostClasses)
        return fail(Errc::bad_data,
                    "more than 255 different numbers: a measure, rather than classes");
      known = std::uint8_t(out_.numbers.size());
      out_.numbers.push_back(number);
    }
    out_.pixels.push_back(known);
    return {};
  }
};

using Xml = std::unique_ptr<CPLXMLNode, decltype([](CPLXMLNode* x) { CPLDestroyXMLNode(x); })>;

/// Of band 1 in FILE.aux.xml, where GDAL and QGIS put what a format has no room for; null: there is
/// none. Fails where one is there that cannot be read. GDAL itself may not look there
/// (gdal_setup.cpp), since it can change what pixels mean. Names and colours cannot.
Result<Xml> said_beside(const std::string& path) {
  constexpr std::size_t kMost = 16 << 20;
  const auto text = read_regular_file(path + ".aux.xml");
  if (!text && text.error().code == Errc::io) return std::unexpected(text.error());
  if (!text || text->size() > kMost) return nullptr;
  const gdal::Complaints complaints;
  const Xml whole(CPLParseXMLString(text->c_str()));
  const CPLXMLNode* const set = whole ? CPLGetXMLNode(whole.get(), "=PAMDataset") : nullptr;
  for (const CPLXMLNode* x = set ? set->psChild : nullptr; x; x = x->psNext)
    if (x->eType == CXT_Element && std::string_view(x->pszValue) == "PAMRasterBand" &&
        std::string_view(CPLGetXMLValue(x, "band", "1")) == "1")
      return Xml(CPLCloneXMLTree(x));
  return nullptr;
}

/// Names of other makers may be Latin-1; those of tiles are UTF-8.
std::string as_utf8(const std::string& text) {
  if (CPLIsUTF8(text.c_str(), -1)) return text;
  char* const made = CPLRecode(text.c_str(), CPL_ENC_ISO8859_1, CPL_ENC_UTF8);
  std::string recoded = made;
  CPLFree(made);
  return recoded;
}

/// What the raster says of its classes, wherever it says it.
class Legend {
 public:
  /// `beside`: as said_beside() gives it.
  Legend(GDALRasterBand& band, const Xml& beside)
      : colours_(band.GetColorTable()), table_(band.GetDefaultRAT()) {
    char** const names = band.GetCategoryNames();
    names_.assign(names, names + CSLCount(names));
    if (!beside) return;
    if (const CPLXMLNode* const all = CPLGetXMLNode(beside.get(), "CategoryNames");
        all && names_.empty())
      for (const CPLXMLNode* x = all->psChild; x; x = x->psNext)
        if (x->eType == CXT_Element) names_.push_back(CPLGetXMLValue(x, nullptr, ""));
    if (CPLXMLNode* const rows = CPLGetXMLNode(beside.get(), "GDALRasterAttributeTable");
        rows && !table_ && beside_.XMLInit(rows, "") == CE_None)
      table_ = &beside_;
  }

  CoverClass of(int number) const {
    CoverClass c{.number = std::uint16_t(number), .name = as_utf8(name(number))};
    if (colours_ && number < colours_->GetColorEntryCount()) {
      GDALColorEntry e{};
      colours_->GetColorEntryAsRGB(number, &e);
      c.colour = {std::uint8_t(e.c1), std::uint8_t(e.c2), std::uint8_t(e.c3)};
    } else if (const auto red = cell(number, GFU_Red), green = cell(number, GFU_Green),
               blue = cell(number, GFU_Blue);
               red && green && blue) {
      c.colour = {byte(*red), byte(*green), byte(*blue)};
    }
    return c;
  }

 private:
  const GDALColorTable* const colours_;
  const GDALRasterAttributeTable* table_;
  GDALDefaultRasterAttributeTable beside_;
  std::vector<std::string> names_;  // by number

  struct Cell {
    int row, col;
  };

  std::optional<Cell> cell(int number, GDALRATFieldUsage usage) const {
    if (!table_) return {};
    const Cell at{table_->GetRowOfValue(number), table_->GetColOfUsage(usage)};
    return at.row < 0 || at.col < 0 ? std::nullopt : std::optional(at);
  }
  std::uint8_t byte(const Cell& at) const {
    return std::uint8_t(std::clamp(table_->GetValueAsInt(at.row, at.col), 0, 255));
  }
  std::string name(int number) const {
    if (std::size_t(number) < names_.size() && !names_[std::size_t(number)].empty())
      return names_[std::size_t(number)];
    const auto at = cell(number, GFU_Name);
    return at ? table_->GetValueAsString(at->row, at->col) : "";
  }
};

class RasterCover : public LandCover {
 public:
  RasterCover(Classes read, const Legend& legend, const gdal::PlacedRaster& raster)
      : frame_(raster.frame), bounds_(frame_.bounds()), width_(read.width), height_(read.height) {
    scale_ = {double(width_) / raster.set->GetRasterXSize(),
              double(height_) / raster.set->GetRasterYSize()};
    std::vector<int> numbers = read.numbers;
    std::ranges::sort(numbers);
    std::string said = raster.place + " " + std::to_string(width_);
    for (const int number : numbers) {
      classes_.push_back(legend.of(number));
      said += "\n" + std::to_string(number) + " " + classes_.back().name;
      if (const auto& c = classes_.back().colour)
        for (const std::uint8_t byte : *c) said += " " + std::to_string(byte);
    }
    std::array<std::uint8_t, kMostClasses + 1> sorted{};
    sorted[kNone] = kNone;
    for (std::size_t coming = 0; coming < numbers.size(); ++coming)
      sorted[coming] =
          std::uint8_t(std::ranges::lower_bound(numbers, read.numbers[coming]) - numbers.begin());
    pixels_ = std::move(read.pixels);
    for (std::uint8_t& pixel : pixels_) pixel = sorted[pixel];
    said += "\n" + hash128({pixels_.data(), pixels_.size()}).text();
    fingerprint_ = hash128(said).text();
  }

  void at(std::span<const Geographic> places,
          std::span<std::optional<std::uint16_t>> out) const override {
    std::vector<Vec2> pixels(places.size());
    frame_.to_pixel(places, pixels);
    for (std::size_t i = 0; i < places.size(); ++i) out[i] = of_pixel(pixels[i]);
  }
  const std::vector<CoverClass>& classes() const override { return classes_; }
  const std::string& fingerprint() const override { return fingerprint_; }
  const GeoRect& bounds() const override { return bounds_; }

 private:
  gdal::Frame frame_;
  GeoRect bounds_;
  int width_, height_;
  Vec2 scale_;  // kept pixels a pixel of the file
  std::vector<std::uint8_t> pixels_;
  std::vector<CoverClass> classes_;
  std::string fingerprint_;

  /// `file`: in pixels of the file, whose first one's centre is (0, 0).
  std::optional<std::uint16_t> of_pixel(Vec2 file) const {
    const double x = (file.x + .5) * scale_.x, y = (file.y + .5) * scale_.y;  // from the corner
    if (!(x >= 0 && y >= 0 && x <= width_ && y <= height_)) return {};
    const auto col = std::min(std::size_t(x), std::size_t(width_ - 1));
    const auto row = std::min(std::size_t(y), std::size_t(height_ - 1));
    const std::uint8_t found = pixels_[row * std::size_t(width_) + col];
    return found == kNone ? std::nullopt : std::optional<std::uint16_t>(found);
  }
};

}  // namespace

Result<std::shared_ptr<const LandCover>> LandCover::open(const std::string& path) {
  const auto raster = gdal::open_placed(path, "a raster tind reads");
  if (!raster) return std::unexpected(raster.error());
  GDALRasterBand& band = *raster->set->GetRasterBand(1);
  if (!GDALDataTypeIsInteger(band.GetRasterDataType()))
    return fail(Errc::bad_data, path + ": its numbers are " +
                                    GDALGetDataTypeName(band.GetRasterDataType()) +
                                    ": a measure, rather than classes, which are whole numbers");
  if (raster->set->GetRasterCount() >= 3)
    return fail(Errc::bad_data,
                path +
                    ": several bands are a picture, rather than classes; for its colours there "
                    "is --drape");
  auto read = Reader(band).read();
  if (!read) return fail(path, read.error());
  if (read->numbers.empty()) return fail(Errc::bad_data, path + ": no pixel has a class");
  const auto beside = said_beside(path);
  if (!beside) return std::unexpected(beside.error());
  return std::make_shared<RasterCover>(std::move(*read), Legend(band, *beside), *raster);
}

}  // namespace tind
