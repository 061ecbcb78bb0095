// What `scan mesh` and `map mesh` are asked for.
#ifndef STRATA_CLIENT_CLI_MESH_MESH_OPTIONS_H_
#define STRATA_CLIENT_CLI_MESH_MESH_OPTIONS_H_

#include <cstddef>
#include <optional>
#include <string>

#include <Eigen/Geometry>

#include "core/world/scan.h"

namespace strata::cli {

struct MeshOptions {
  std::string map;
  bool one_scan = false;  // `scan` alone, in its own frame
  ScanId scan;
  std::string out;
  std::string method = "tsdf";
  double voxel_m = 0.05;
  std::optional<Eigen::AlignedBox3d> region;  // in the map [m]
  std::string class_name;                     // points of this class only; empty: all
  std::optional<std::size_t> simplify;        // at most so many triangles
  Eigen::Vector3d relative_to = Eigen::Vector3d::Zero();
};

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MESH_MESH_OPTIONS_H_
