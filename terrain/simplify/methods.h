#pragma once
// The table of simplification methods, for people and programs that choose one.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/simplify/options.h"

namespace tind {

struct HeldMesh;

/// What one chooses by, and what one reads when it is chosen.
struct MethodInfo {
  std::string name = {};
  std::string minimises, stops, guarantees, source;
  std::string take_for;  // when it is the right one
  /// What it does with voids where nobody fills or outlines them (constraints/voids.h): holes,
  /// covered, or narrow (closes those narrower than its cells).
  std::string voids_alone;
  /// Time and RMS error beside qem's at 10 % of the triangles (scripts/reproduce --only choose).
  std::string time, rms;
  bool tiles = false;                     // it can hold a border, so it makes tiles, too
  std::vector<std::string> options = {};  // that it reads, as they are typed
};

/// All methods, in the order in which help lists them.
std::span<const MethodInfo> methods();

/// Each method with its options as they are by default, in the same order.
std::vector<MethodOptions> all_methods();

std::string method_name(const MethodOptions&);

const MethodInfo& info_of(const MethodOptions&);

/// Fails (invalid_argument), with all names that there are.
Result<MethodOptions> method_named(const std::string& name);

/// Fails (invalid_argument) where an option makes no sense.
Result<void> check_options(const MethodOptions&);

/// Simplifies a mesh whose border is held as far as its bound and its count allow. Returns the
/// method's steps. Fails with cancelled, or with unsupported where the method does not collapse
/// (HeldMesh).
Result<std::uint64_t> simplify_held(HeldMesh&, const MethodOptions&, const Progress& = {});

/// "vertex-removal:degree": the method and the value of its kVariant; or a method's name alone.
Result<MethodOptions> method_variant(const std::string& text);

}  // namespace tind
