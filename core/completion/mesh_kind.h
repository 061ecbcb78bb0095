// Kinds out of drawings.
#ifndef STRATA_CORE_COMPLETION_MESH_KIND_H_
#define STRATA_CORE_COMPLETION_MESH_KIND_H_

#include <array>
#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/world/things/kind.h"

namespace strata {

// The shape of a mesh [m], z up, wherever it stands: points evenly over its triangles, 3 cm apart
// or as far as kMaxKindPoints are; the mesh itself where it is no larger than a kind's may be. It
// is moved so that zero is in the middle of its base. Pure. INVALID_ARGUMENT for what
// ValidateKindShape() refuses, and for a mesh without area.
absl::StatusOr<KindShape> KindShapeOfMesh(std::span<const Eigen::Vector3f> vertices,
                                          std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_MESH_KIND_H_
