// Scans in, triangles out, by the method asked for.
#ifndef STRATA_CLIENT_CLI_MESH_MESH_MAKER_H_
#define STRATA_CLIENT_CLI_MESH_MESH_MAKER_H_

#include <cstdint>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/cli/mesh/mesh_options.h"
#include "client/cli/mesh/scan_clouds.h"
#include "client/cli/terminal/command.h"
#include "core/mesh/triangle_mesh.h"

namespace strata::cli {

struct MadeMesh {
  TriangleMesh mesh;
  std::uint64_t points = 0;        // that it was made of, thinned
  std::optional<double> alpha_m2;  // of an alpha shape
};

// Shows progress. NOT_FOUND where there are no points, FAILED_PRECONDITION where they make no
// triangle, RESOURCE_EXHAUSTED for what does not fit.
absl::StatusOr<MadeMesh> MakeMesh(Context& context,
                                  const ScanClouds& clouds,
                                  const MeshOptions& options);

// Gives the vertices the colours of the scans, if they have any.
absl::Status ColourMesh(Context& context,
                        const ScanClouds& clouds,
                        const MeshOptions& options,
                        TriangleMesh& mesh);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MESH_MESH_MAKER_H_
