// The surface on which a function over a sparse grid is zero (Lorensen and Cline 1987).
// Internal to core/mesh, not installed.
#ifndef STRATA_CORE_MESH_MARCHING_CUBES_H_
#define STRATA_CORE_MESH_MARCHING_CUBES_H_

#include <cstddef>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/mesh/triangle_mesh.h"
#include "core/mesh/voxel_blocks.h"

namespace strata {

// The value of a node of block `i` of the keys given.
using NodeReader = absl::FunctionRef<float(std::size_t i, std::size_t node)>;

// Negative is inside, NaN unknown: no triangle reaches there. Nodes of no block have the value
// `outside`; where that is a number, the surface is closed. Where the value goes from one node to
// the next by more than `steepest` through zero there is no surface but two things side by side.
// Each vertex stands once, between two nodes; vertices and triangles come in the order of the
// blocks' keys, whatever the order given. `only`: cubes from nodes of these blocks, all if null.
// RESOURCE_EXHAUSTED for 2³¹ vertices and more; the stop's status.
absl::StatusOr<TriangleMesh> MarchCubes(const std::vector<BlockKey>& keys,
                                        NodeReader read,
                                        float outside,
                                        float steepest,
                                        const NodeGrid& grid,
                                        const Stop& stop,
                                        const BlockBox* only = nullptr);

}  // namespace strata

#endif  // STRATA_CORE_MESH_MARCHING_CUBES_H_
