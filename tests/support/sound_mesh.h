#pragma once
// What every reader of mesh files promises for any bytes, for its fuzz target to call.

#include <cstddef>

#include "proto/mesh/mesh_io.h"

namespace tind::test {

/// `read`: what a reader made of `size` bytes. Memory in proportion, indices in range, errors of
/// one line; what is read can be written and read again. Aborts otherwise.
int expect_sound_mesh(const Result<proto::Mesh>& read, std::size_t size);

}  // namespace tind::test
