#pragma once
// Is a GLB what glTF 2.0 calls one? Anyone's: as far as its chunks, its JSON and the places that
// these name tell. What is compressed is not unpacked.

#include <string>
#include <string_view>

namespace tind {

/// The first thing that is wrong, to be read after the file's name ("ends before its buffer does");
/// empty: nothing. Linear in the bytes.
std::string wrong_with_glb(std::string_view bytes);

/// "meshopt", "draco"; "none" also of what is no GLB.
std::string glb_compression(std::string_view bytes);

}  // namespace tind
