// The surface of a kind of things, as triangles.
#ifndef STRATA_CLIENT_CLI_OBJECTS_KIND_MESH_H_
#define STRATA_CLIENT_CLI_OBJECTS_KIND_MESH_H_

#include <cstddef>
#include <string>

#include "absl/status/statusor.h"

#include "client/cli/terminal/command.h"
#include "core/mesh/triangle_mesh.h"
#include "core/world/things/kind.h"

namespace strata::cli {

struct KindMesh {
  TriangleMesh mesh;                  // frame of the kind
  std::string method;                 // "imported", "tsdf", "contour"
  std::size_t things = 0, scans = 0;  // that it is made of
};

// What was imported as triangles is given as it came. Of others the scans of all things of the kind
// are laid over each other, and their signed distance meshed (thesis 11.2.2; core/mesh); where
// there are none, or too few points, a contour around the points that the library has of it.
// FAILED_PRECONDITION where that makes no triangle either.
absl::StatusOr<KindMesh> MeshOfKind(Context& context,
                                    const std::string& map,
                                    const ThingKind& kind,
                                    double voxel_m);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_OBJECTS_KIND_MESH_H_
