#pragma once
// Where a command writes, against what it reads: refused before any work, so that no input is lost
// and no output overwrites another.

#include <string>
#include <vector>

namespace tind {
struct ShapeFiles;
}

namespace tind::cli {

struct DemInput;
struct LineInput;
struct SurfaceInput;

/// What a DEM, its options' geoid files and the lines over it are read from, as they were named,
/// and the parts of VRTs. `others`: DEMs that are opened as the first is.
std::vector<std::string> inputs_of(const DemInput&, const std::vector<std::string>& others = {});
std::vector<std::string> inputs_of(const DemInput&, const LineInput&);
/// The same with layers, of which those are left out that cannot be read: opening them says why.
std::vector<std::string> inputs_of(const DemInput&, const SurfaceInput&, const ShapeFiles&);

/// Of `outputs` those that are not empty. kOk, or says on stderr what is wrong and returns its
/// code: kUsage for an output that is an input, a member of a folder or "@list" among them, or a
/// file that is read beside one (the .prj of a .flt) or that a mesh names (material libraries,
/// textures), and for two outputs on one file, counting those that are written beside (the .prj of
/// an .asc, the .mtl of an .obj), or one that is there as another file's. Symbolic links, hard
/// links and ".." hide nothing; devices and pipes may be named as often as one likes. kCannotCreate
/// where an output cannot be written.
int check_outputs(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs);

/// Makes the folder where it is not there. kOk, or says why no file can be made in it and returns
/// kCannotCreate; kUsage for one that none of the program's files are in yet (`known`: the name of
/// one) and one of `inputs` is: among tiles it would be a folder of DEMs no more. kUsage, too,
/// where it would lie in a level of a tile set; nothing is made then.
int check_output_folder(const std::string& path, const std::vector<std::string>& inputs = {},
                        const char* known = "layer.json");

/// Can a store be made there, or one that is there be changed? A file, or a folder that is made
/// where it is not there; nothing is made here, and object storage says so itself. kOk, or says why
/// not and returns kCannotCreate; kUsage for a folder in a level of a tile set.
int check_store_output(const std::string& path);

}  // namespace tind::cli
