#pragma once
// Which methods of simplification make tiles, and how plans and records name them.

#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/pyramid/plan/tile_set_options.h"

namespace tind {

/// Fails (invalid_argument) for a method, or an option of it, that cannot make tiles, and names
/// those that can.
Result<void> check_tile_method(const MethodOptions&);

/// For settings: method_from_text of a method that passes. "bounded" stands alone, for its effort
/// and side are TileSetOptions' own.
Result<MethodOptions> tile_method_from_text(const std::string&);

/// The image for whose sake the method makes meshes; null: there is none, or it asks for no
/// colours.
std::shared_ptr<const ImageColours> counted_colours(const TileSetOptions&);

/// Fails (invalid_argument) where the method asks for the colours of an image and there is none, or
/// one that lies elsewhere than the tiles.
Result<void> check_tile_colours(const TileSetOptions&, const GeoRect& bounds);

/// The fingerprint of the image that counts; nothing where none does.
std::string drape_fingerprint(const TileSetOptions&);

/// The method of the tiles as text, with its options; nothing for bounded, which has none of its
/// own here and was the only one once.
std::string tile_method(const TileSetOptions&);

}  // namespace tind
