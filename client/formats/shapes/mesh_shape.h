// Triangles out of mesh files; the one place that knows Assimp.
#ifndef STRATA_CLIENT_FORMATS_SHAPES_MESH_SHAPE_H_
#define STRATA_CLIENT_FORMATS_SHAPES_MESH_SHAPE_H_

#include <string>

#include "absl/status/status.h"
#include <Eigen/Geometry>

#include "core/world/shape.h"

namespace strata {

// Adds the triangles of a file at T. NOT_FOUND, INVALID_ARGUMENT.
absl::Status AddMeshFile(const std::string& file, const Eigen::Affine3d& T, CollisionShape& shape);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SHAPES_MESH_SHAPE_H_
