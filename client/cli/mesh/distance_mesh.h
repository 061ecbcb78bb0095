// The mesh of `--method tsdf`, in parts where the map is too large for one distance field.
#ifndef STRATA_CLIENT_CLI_MESH_DISTANCE_MESH_H_
#define STRATA_CLIENT_CLI_MESH_DISTANCE_MESH_H_

#include "absl/status/statusor.h"

#include "client/cli/mesh/mesh_maker.h"
#include "client/cli/mesh/mesh_options.h"
#include "client/cli/mesh/scan_clouds.h"
#include "client/cli/terminal/command.h"

namespace strata::cli {

// Without triangles where there are no points. RESOURCE_EXHAUSTED, naming voxels that will do, for
// a mesh of more than 40 million triangles.
absl::StatusOr<MadeMesh> MakeDistanceMesh(Context& context,
                                          const ScanClouds& clouds,
                                          const MeshOptions& options);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MESH_DISTANCE_MESH_H_
