// Bytes a vertex of .tpm beside raw and gzip, and splits a second of the cursor.
//   progressive_stream_bench DEM [max_error_m] [methods...]

#include <cstdio>
#include <cstdlib>

#include "terrain/base/deflate.h"
#include "terrain/progressive/stream/make_progressive.h"
#include "terrain/progressive/stream/progressive_cursor.h"
#include "terrain/progressive/stream/progressive_stream.h"
#include "terrain/simplify/methods.h"
#include "tests/support/bench.h"
#include "tests/support/support.h"

using namespace tind;

namespace {

std::size_t gzip_size(const std::vector<std::uint8_t>& bytes) {
  return deflate(bytes, Wrapping::gzip, 9).size();
}

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// A record as plain numbers: three indices and two positions on the lattice, 4 bytes each.
std::vector<std::uint8_t> raw_records(const proto::MeshStream& s) {
  std::vector<std::uint8_t> out;
  for (const proto::LatticeSplit& r : s.splits) {
    const auto* p = reinterpret_cast<const std::uint8_t*>(&r);
    out.insert(out.end(), p, p + sizeof r);
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> files = {argc > 1 ? argv[1] : test::testdata("crater.tif")};
  const double error = argc > 2 ? std::atof(argv[2]) : 1;
  std::vector<std::string> methods(argv + std::min(argc, 3), argv + argc);
  if (methods.empty())
    methods = {"bounded", "qem", "edge-cost", "memoryless", "attribute-qem", "triangle-collapse"};
  const test::BenchDem dem = test::load_dem(files[0]);
  DemInfo info;
  info.cols = dem.terrain.grid.cols();
  info.rows = dem.terrain.grid.rows();
  std::printf("%s, fine end %g m, heights in steps of an eighth of it\n", files[0].c_str(), error);
  std::printf("%-18s %4s %9s %9s %6s %6s %6s | %8s %8s %9s %9s\n", "method", "1/", "vertices",
              "error m", "raw", "gzip", "tpm", "make s", "encode s", "decode/s", "splits/s");
  for (const std::string& method : methods) {
    for (const double per_post : {1.0, 2.0, 4.0}) {
      SimplifyOptions o;
      o.method = *method_named(method);
      o.stop.max_error_m = error;
      const Lattice lattice{per_post, error / 8};
      const double t0 = now();
      const auto pm = make_progressive(dem.terrain, o, 64, {}, lattice);
      const double t1 = now();
      if (!pm) {
        std::printf("%-18s %s\n", method.c_str(), pm.error().what.c_str());
        continue;
      }
      const auto stream = to_stream(*pm, lattice, info);
      const auto bytes = encode(*stream);
      const double t2 = now();
      const auto back = proto::decode_mesh_stream(*bytes);
      const double t3 = now();
      if (!back || back->splits != stream->splits) return std::printf("WRONG\n"), 1;
      proto::MeshStream base = *stream;
      base.splits.clear(), base.blocks.clear(), base.total_splits = 0;
      const double n = double(pm->splits.size());
      const auto raw = raw_records(*stream);
      const ProgressiveMesh ordered = from_stream(*stream);
      auto cursor = ProgressiveCursor::open(ordered);
      cursor->seek(cursor->size());
      std::uint64_t steps = 0;
      const double t4 = now();
      while (now() - t4 < 1) {
        cursor->seek(0);
        cursor->seek(cursor->size());
        steps += 2 * cursor->size();
      }
      const double t5 = now();
      std::printf("%-18s %4g %9zu %9.3f %6.2f %6.2f %6.2f | %8.2f %8.2f %9.2e %9.2e\n",
                  method.c_str(), per_post, pm->base.vertices.size() + pm->splits.size(),
                  pm->fine_error_m, double(raw.size()) / n, double(gzip_size(raw)) / n,
                  double(bytes->size() - encode(base)->size()) / n, t1 - t0, t2 - t1, n / (t3 - t2),
                  double(steps) / (t5 - t4));
      std::fflush(stdout);
    }
  }
}
