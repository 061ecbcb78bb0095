// Meshes by others.
#ifndef STRATA_TESTS_EXPERIMENTS_MESHES_MESH_PEERS_H_
#define STRATA_TESTS_EXPERIMENTS_MESHES_MESH_PEERS_H_

#include <vector>

#include <Eigen/Core>

#include "core/mesh/triangle_mesh.h"
#include "tests/experiments/meshes/stool.h"

namespace strata::testing {

// PCL's marching cubes over a dense grid of kStoolVoxelM, whose nodes hold the distance to the
// plane of the nearest point (Hoppe et al. 1992); normals of 16 neighbours in each view, towards
// its sensor. Corners at the same place are joined.
TriangleMesh PclContour(const std::vector<StoolView>& views);

// CGAL's Alpha_shape_3 in its general mode; triangles face anywhere.
TriangleMesh CgalAlphaShape(const std::vector<Eigen::Vector3d>& points, double alpha_m2);

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_MESHES_MESH_PEERS_H_
