// The two schemes lead to materials that FlightGear 2020.3 has in all its regions; that of CORINE
// is how FlightGear itself reads such numbers.

#include "terrain/flightgear/cover_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <span>
#include <utility>

#include "terrain/base/hash.h"

namespace tind::flightgear {
namespace {

struct Known {
  std::uint16_t number;
  const char* material;
};

constexpr Known kWorldCover[] = {{10, "MixedForest"}, {20, "ShrubCover"}, {30, "Grassland"},
                                 {40, "MixedCrop"},   {50, "SubUrban"},   {60, "BarrenCover"},
                                 {70, "Glacier"},     {80, "Lake"},       {90, "Marsh"},
                                 {95, "SaltMarsh"},   {100, "HerbTundra"}};

/// By code; a raster's numbers from 1 on stand for them in this order.
constexpr Known kCorine[] = {{111, "Urban"},
                             {112, "SubUrban"},
                             {121, "Industrial"},
                             {122, "Transport"},
                             {123, "Port"},
                             {124, "Airport"},
                             {131, "Gravel"},
                             {132, "Gravel"},
                             {133, "Construction"},
                             {141, "Greenspace"},
                             {142, "Greenspace"},
                             {211, "MixedCrop"},
                             {212, "IrrCrop"},
                             {213, "Rice"},
                             {221, "Vineyard"},
                             {222, "Orchard"},
                             {223, "Olives"},
                             {231, "MixedCropPastureCover"},
                             {241, "MixedCrop"},
                             {242, "ComplexCrop"},
                             {243, "NaturalCrop"},
                             {244, "AgroForest"},
                             {311, "DeciduousBroadCover"},
                             {312, "EvergreenForest"},
                             {313, "MixedForest"},
                             {321, "Grassland"},
                             {322, "Heath"},
                             {323, "Sclerophyllous"},
                             {324, "ShrubCover"},
                             {331, "Sand"},
                             {332, "BareTundraCover"},
                             {333, "HerbTundra"},
                             {334, "Burnt"},
                             {335, "Glacier"},
                             {411, "Marsh"},
                             {412, "Bog"},
                             {421, "SaltMarsh"},
                             {422, "Saline"},
                             {423, "Littoral"},
                             {511, "Watercourse"},
                             {512, "Lake"},
                             {521, "Lagoon"},
                             {522, "Estuary"},
                             {523, "Ocean"}};

/// Names that scenery has for land beside those of the schemes.
constexpr const char* kOtherLand[] = {"Bamboo",
                                      "BuiltUpCover",
                                      "Canal",
                                      "Cemetery",
                                      "CropGrassCover",
                                      "CropWoodCover",
                                      "DeciduousForest",
                                      "Default",
                                      "Dirt",
                                      "DryCrop",
                                      "DryLake",
                                      "Dump",
                                      "EvergreenBroadCover",
                                      "EvergreenNeedleCover",
                                      "FloodLand",
                                      "GolfCourse",
                                      "GrassCover",
                                      "HerbTundraCover",
                                      "IntermittentLake",
                                      "Lava",
                                      "MixedForestCover",
                                      "OpenMining",
                                      "PackIce",
                                      "PolarIce",
                                      "Pond",
                                      "RainForest",
                                      "Reservoir",
                                      "Rock",
                                      "SavannaCover",
                                      "Scrub",
                                      "ScrubCover",
                                      "ShrubGrassCover",
                                      "SnowCover",
                                      "Stream",
                                      "Town",
                                      "WoodedTundraCover"};

constexpr std::size_t kLongestName = 63;

bool is_material(std::string_view name) {
  const auto is_word = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  };
  return !name.empty() && name.size() <= kLongestName && std::ranges::all_of(name, is_word);
}

bool is_known_land(std::string_view name) {
  const auto is_it = [name](const Known& known) { return known.material == name; };
  return std::ranges::any_of(kWorldCover, is_it) || std::ranges::any_of(kCorine, is_it) ||
         std::ranges::any_of(kOtherLand, [name](const char* other) { return other == name; });
}

Result<void> add(std::string_view word, Materials& all) {
  if (word == "worldcover") {
    for (const Known& known : kWorldCover) all[known.number] = known.material;
    return {};
  }
  if (word == "corine") {
    std::uint16_t in_rasters = 0;
    for (const Known& known : kCorine) all[known.number] = all[++in_rasters] = known.material;
    return {};
  }
  const std::size_t equals = word.find('=');
  const std::string_view digits = word.substr(0, equals);
  std::uint16_t number = 0;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (equals == word.npos || read.ec != std::errc() || read.ptr != digits.data() + digits.size())
    return fail(Errc::invalid_argument,
                fmt::format("\"{}\" is neither a scheme (worldcover, corine) nor a class from 0 to "
                            "65535 with its material, like 10=EvergreenForest",
                            word));
  const std::string_view name = word.substr(equals + 1);
  if (!is_material(name))
    return fail(Errc::invalid_argument,
                fmt::format("\"{}\" can be no material of FlightGear's: letters, digits, _ and -, "
                            "{} at most, like EvergreenForest",
                            name, kLongestName));
  all[number] = name;
  return {};
}

class CoverOfMaterials : public LandCover {
 public:
  CoverOfMaterials(std::shared_ptr<const LandCover> cover, Materials said)
      : cover_(std::move(cover)), said_(std::move(said)) {}

  void at(std::span<const Geographic> places,
          std::span<std::optional<std::uint16_t>> out) const override {
    cover_->at(places, out);
  }
  const std::vector<CoverClass>& classes() const override { return cover_->classes(); }
  const std::string& fingerprint() const override { return cover_->fingerprint(); }
  const GeoRect& bounds() const override { return cover_->bounds(); }

  /// Null: nobody said it.
  const std::string* material(std::uint16_t number) const {
    const auto found = said_.find(number);
    return found == said_.end() ? nullptr : &found->second;
  }

 private:
  std::shared_ptr<const LandCover> cover_;
  Materials said_;
};

}  // namespace

Result<Materials> parse_materials(std::string_view text) {
  Materials all;
  while (!text.empty()) {
    const std::size_t comma = std::min(text.find(','), text.size());
    if (auto done = add(text.substr(0, comma), all); !done) return std::unexpected(done.error());
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  return all;
}

std::shared_ptr<const LandCover> with_materials(std::shared_ptr<const LandCover> cover,
                                                Materials said) {
  return std::make_shared<const CoverOfMaterials>(std::move(cover), std::move(said));
}

std::vector<std::string> class_materials(const LandCover& cover) {
  std::vector<std::string> all;
  const auto* const said = dynamic_cast<const CoverOfMaterials*>(&cover);
  for (const CoverClass& one : cover.classes()) {
    const std::string* const found = said ? said->material(one.number) : nullptr;
    if (found)
      all.push_back(*found);
    else
      all.push_back(is_known_land(one.name) ? one.name : "");
  }
  return all;
}

std::string digest_of(const LandCover& cover) {
  std::string said = cover.fingerprint();
  for (const std::string& material : class_materials(cover)) said += " " + material;
  return hash128(said).text();
}

}  // namespace tind::flightgear
