#pragma once
// Inputs of processes that are a number, a format or a few places: read, and described.

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "server/api/members.h"
#include "server/services/jobs/jobs.h"

namespace tind::api {

/// One number that a subcommand takes.
struct NumberInput {
  const char *name, *flag, *title, *description;
  double low, high;
  double initial;  // NaN: none
};

/// Into the order as its option; problems with its range.
void read_number(const NumberInput&, Members& inputs, services::JobOrder&, Problems&);
nlohmann::ordered_json describe_number(const NumberInput&);

/// A kind of result, by the extension that `format` names.
struct FileKind {
  const char *extension, *media_type;
};
std::vector<std::string> extensions(std::span<const FileKind>);
nlohmann::ordered_json describe_format(std::span<const FileKind>);

/// "ply", "obj", ...: of the formats of meshes that tind writes, or reads.
std::vector<std::string> mesh_formats_to_write();
std::vector<std::string> mesh_formats_to_read();

/// [x, y], or a list of `least` to `most` of such, as an option of places takes them: "x,y x,y".
/// Empty (and a problem) where it is none.
std::string read_place(const char* name, Members& inputs, Problems&);
std::string read_line(const char* name, std::size_t least, std::size_t most, Members& inputs,
                      Problems&);
/// The places alone, where `json` is such a list; else empty.
std::string line_text(const Json& json, std::size_t least, std::size_t most);
nlohmann::ordered_json describe_place(const char* title, const char* description);
nlohmann::ordered_json describe_line(const char* title, const char* description, std::size_t least,
                                     std::size_t most);

}  // namespace tind::api
