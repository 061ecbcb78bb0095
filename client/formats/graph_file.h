// Pose graphs in the files of g2o and TORO. Vertices keep their numbers.
#ifndef STRATA_CLIENT_FORMATS_GRAPH_FILE_H_
#define STRATA_CLIENT_FORMATS_GRAPH_FILE_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/posegraph/planar_pose_graph.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

struct GraphFile {
  std::vector<std::uint64_t> ids;  // of the nodes, ascending
  // False if the file lists edges only; poses are then the identity.
  bool has_poses = false;
  // Relative poses and fixed nodes only. The information is in Strata's order and units.
  std::variant<PoseGraphProblem, PlanarPoseGraph> graph;
  // Informations with a negative eigenvalue, which were made semidefinite, and the least of those.
  std::size_t clipped = 0;
  double least_eigenvalue = 0.0;
  std::size_t dropped = 0;  // edges of which nothing positive was left, or that said nothing at all
};

// What to tell people of clipped informations and dropped edges; empty if there are none.
std::string ClippedWarning(const GraphFile& file);

// g2o: VERTEX_SE3:QUAT, EDGE_SE3:QUAT, VERTEX_SE2, EDGE_SE2, FIX. TORO: VERTEX2, EDGE2
// (information Ixx Ixy Iyy Itt Ixt Iyt), VERTEX3, EDGE3 (x y z roll pitch yaw, information
// optional). Other lines are errors, but for comments and TORO's EQUIV, which g2o ignores too.
//
// TORO's spatial information is of [x y z roll pitch yaw] and is taken as that of a right-hand
// step; the two agree for rotations that are measured to be small or isotropic in their
// information.
//
// NOT_FOUND; INVALID_ARGUMENT naming file, line, value and cure: wrong counts, numbers that are not
// finite, quaternions off unit length by more than 1 %, spatial beside planar lines, vertices that
// come twice or are missing (unless there are none), edges from a vertex to itself. Informations
// with negative eigenvalues, of which public graphs have thousands, are clipped to the nearest
// positive semidefinite matrix and counted; edges whose information is zero then are dropped and
// counted.
absl::StatusOr<GraphFile> ReadGraph(const std::filesystem::path& path);
absl::StatusOr<GraphFile> ParseGraph(absl::string_view text);

// As g2o, 17 digits: every node with its number, FIX for fixed nodes, every relative pose.
// REQUIRES: as many ids as nodes.
std::string G2oText(const GraphFile& file);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_GRAPH_FILE_H_
