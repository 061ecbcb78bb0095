// Collision geometry of a robot description.
#ifndef STRATA_CLIENT_FORMATS_SHAPES_URDF_SHAPE_H_
#define STRATA_CLIENT_FORMATS_SHAPES_URDF_SHAPE_H_

#include <string>

#include "absl/status/statusor.h"

#include "client/formats/shapes/shape_reader.h"
#include "core/world/shape.h"

namespace strata {

// As ReadShape() of a .urdf.
absl::StatusOr<CollisionShape> ReadUrdfShape(const std::string& file, const JointPositions& joints);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SHAPES_URDF_SHAPE_H_
