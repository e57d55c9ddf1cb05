#include "terrain/raster/vector_file.h"

#include <ogrsf_frmts.h>

#include <memory>

#include "terrain/raster/gdal/crs/gdal_crs.h"
#include "terrain/raster/gdal/fixed_date.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/memory_file.h"

namespace tind {
namespace {

using Dataset = std::unique_ptr<GDALDataset, decltype([](GDALDataset* d) { GDALClose(d); })>;
using Feature =
    std::unique_ptr<OGRFeature, decltype([](OGRFeature* f) { OGRFeature::DestroyFeature(f); })>;

bool put(OGRLayer& layer, const TriangleFeatures& mesh, const std::array<std::uint32_t, 3>& t) {
  const Feature feature(OGRFeature::CreateFeature(layer.GetLayerDefn()));
  auto ring = std::make_unique<OGRLinearRing>();
  for (const std::size_t corner : {0, 1, 2, 0}) {
    const auto& p = mesh.positions[t[corner]];
    ring->addPoint(p[0], p[1], p[2]);
  }
  auto polygon = std::make_unique<OGRPolygon>();
  polygon->addRingDirectly(ring.release());
  feature->SetGeometryDirectly(polygon.release());
  return layer.CreateFeature(feature.get()) == OGRERR_NONE;
}

/// False where GDAL has complained.
bool make(GDALDataset& file, const TriangleFeatures& mesh, OGRSpatialReference crs) {
  const std::string description = "DESCRIPTION=" + mesh.description;
  const char* const only_gpkg[] = {description.c_str(), nullptr};
  const bool gpkg = std::string_view(file.GetDriverName()) == "GPKG";
  OGRLayer* const layer =
      file.CreateLayer("mesh", mesh.crs_wkt.empty() && !gpkg ? nullptr : &crs, wkbPolygon25D,
                       gpkg && !mesh.description.empty() ? const_cast<char**>(only_gpkg) : nullptr);
  if (!layer) return false;
  const bool all_at_once = file.StartTransaction() == OGRERR_NONE;
  for (const auto& t : mesh.triangles)
    if (!put(*layer, mesh, t)) return false;
  return !all_at_once || file.CommitTransaction() == OGRERR_NONE;
}

}  // namespace

Result<std::string> encode_triangles(VectorFormat format, const TriangleFeatures& mesh) {
  gdal::register_vectors();
  const auto crs = gdal::crs_of_layer(mesh.crs_wkt);
  if (!crs) return std::unexpected(crs.error());
  const bool gpkg = format == VectorFormat::geopackage;
  const char* const name = gpkg ? "GPKG" : "FlatGeobuf";
  gdal::Complaints complaints;
  const gdal::FixedDate date;
  const gdal::MemoryFile memory(gpkg ? ".gpkg" : ".fgb");
  GDALDriver* const driver = GetGDALDriverManager()->GetDriverByName(name);
  Dataset file(driver ? driver->Create(memory.name().c_str(), 0, 0, 0, GDT_Unknown, nullptr)
                      : nullptr);
  const bool made = file && make(*file, mesh, *crs);
  file.reset();  // writes what is left, an index for one
  std::string bytes = made && !complaints.failed() ? memory.bytes() : std::string();
  if (bytes.empty())
    return fail(Errc::io,
                std::string("cannot make a ") + name + " file: " + complaints.text("no reason"));
  return bytes;
}

}  // namespace tind
