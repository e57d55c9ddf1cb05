// What SimGear's own reader, SGBinObject, makes of BTG files: the same lines as btg.py prints.
// g++ -std=c++17 sg_bin_object.cpp -lSimGearScene -lSimGearCore ... (Debian: libsimgear-dev)

#include <cstdio>
#include <simgear/io/sg_binobj.hxx>
#include <simgear/misc/sg_path.hxx>

namespace {

void print(const SGBinObject& bin) {
  const SGVec3d& center = bin.get_gbs_center();
  std::printf("version %d center %.17g %.17g %.17g radius %.9g\n", int(bin.get_version()),
              center[0], center[1], center[2], double(bin.get_gbs_radius()));
  for (const SGVec3d& v : bin.get_wgs84_nodes())
    std::printf("v %.17g %.17g %.17g\n", center[0] + v[0], center[1] + v[1], center[2] + v[2]);
  for (const SGVec3f& n : bin.get_normals())
    std::printf("n %.9g %.9g %.9g\n", double(n[0]), double(n[1]), double(n[2]));
  for (const SGVec2f& t : bin.get_texcoords())
    std::printf("t %.9g %.9g\n", double(t[0]), double(t[1]));
  for (std::size_t part = 0; part < bin.get_tris_v().size(); ++part) {
    const auto &v = bin.get_tris_v()[part], &n = bin.get_tris_n()[part],
               &t = bin.get_tris_tcs()[part][0];
    std::printf("part %s %zu %zu %zu\n", bin.get_tri_materials()[part].c_str(), v.size(), n.size(),
                t.size());
    for (std::size_t i = 0; i < v.size() && i < n.size() && i < t.size(); ++i)
      std::printf("c %d %d %d\n", v[i], n[i], t[i]);
  }
}

}  // namespace

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    SGBinObject bin;
    if (!bin.read_bin(SGPath(argv[i]))) {
      std::fprintf(stderr, "%s: SGBinObject cannot read it\n", argv[i]);
      return 1;
    }
    print(bin);
  }
}
