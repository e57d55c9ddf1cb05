// Tiles as progressive meshes: what a stream takes in bytes and time beside its tile, and how much
// of it is enough for a coarser error. Medians over up to 12 tiles of each level.
//
//   tile_stream_bench [DEM]    rainier.tif by default

#include "proto/stream/mesh_stream.h"
#include "proto/tile/quantized_mesh.h"
#include "server/http/message/representation.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/pyramid/make/tile_stream.h"
#include "terrain/store/tile_set.h"
#include "tests/support/bench.h"

using namespace tind;

namespace {

struct Row {
  std::vector<double> vertices, tile_bytes, gzip_bytes, stream_bytes, base_bytes, bytes_x2,
      bytes_x4, tile_s, stream_s, splits_per_s;
};

std::size_t gzip_size(const std::vector<std::uint8_t>& bytes) {
  const auto both = http::Representation::make(
      {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, {.content_type = "x"});
  http::Conditions client;
  client.gzip = true;
  return both->reply(client).payload->body().size();
}

void add(Row& row, const TileSet& set, TileId id) {
  Result<TileBytes> tile = fail(Errc::internal, "");
  Result<proto::MeshStream> stream = fail(Errc::internal, "");
  row.tile_s.push_back(test::seconds_of([&] { tile = set.tile(id, {}); }));
  const auto bare = proto::strip_extensions(tile->bytes, {.metadata = true});
  row.stream_s.push_back(
      test::seconds_of([&] { stream = tile_stream(id, bare, VerticalDatum::ellipsoid); }));
  const auto bytes = proto::encode(*stream);
  Result<proto::MeshStream> back = fail(Errc::internal, "");
  std::vector<double> times;
  for (int i = 0; i < 5; ++i) {
    times.push_back(test::seconds_of([&] {
      if (auto decoded = proto::decode_mesh_stream(*bytes)) back = std::move(*decoded);
    }));
  }
  row.vertices.push_back(double(back->base_vertices.size() + back->splits.size()));
  row.tile_bytes.push_back(double(bare.size()));
  row.gzip_bytes.push_back(double(gzip_size(bare)));
  row.stream_bytes.push_back(double(bytes->size()));
  row.base_bytes.push_back(double(back->base_bytes));
  for (const auto& [factor, to] : {std::pair{2, &row.bytes_x2}, {4, &row.bytes_x4}})
    to->push_back(double(bytes_until(*back, {.max_error_m = factor * back->fine_error_m})));
  row.splits_per_s.push_back(double(back->splits.size()) / test::median(times));
}

}  // namespace

int main(int argc, char** argv) {
  auto dem = DemSource::open(
      std::vector{argc > 1 ? std::string(argv[1]) : test::default_dem("rainier.tif")});
  if (!dem) return fmt::print(stderr, "{}\n", dem.error().what), 2;
  const auto set = open_dem_tiles(std::move(*dem), {});
  if (!set) return fmt::print(stderr, "{}\n", set.error().what), 2;
  fmt::print("{:>5} {:>5} {:>8} | {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} | {:>7} {:>9} {:>9}\n",
             "level", "tiles", "vertices", "tile B", "gzip B", "stream B", "base B", "2x error",
             "4x error", "tile ms", "stream ms", "splits/s");
  for (int z = 0; z <= (*set)->layer().maxzoom; ++z) {
    std::vector<TileId> all;
    for (const proto::TileRange& r : (*set)->layer().available[std::size_t(z)])
      for (std::uint32_t x = r.start_x; x <= r.end_x; ++x)
        for (std::uint32_t y = r.start_y; y <= r.end_y; ++y) all.push_back({z, x, y});
    Row row;
    const std::size_t step = std::max<std::size_t>(1, all.size() / 12);
    for (std::size_t i = 0; i < all.size(); i += step) add(row, **set, all[i]);
    const auto m = [](const std::vector<double>& v) { return test::median(v); };
    fmt::print(
        "{:>5} {:>5} {:>8} | {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} | {:>7.1f} {:>9.1f} {:>9.2e}\n", z,
        row.tile_s.size(), m(row.vertices), m(row.tile_bytes), m(row.gzip_bytes),
        m(row.stream_bytes), m(row.base_bytes), m(row.bytes_x2), m(row.bytes_x4),
        1e3 * m(row.tile_s), 1e3 * m(row.stream_s), m(row.splits_per_s));
  }
}
