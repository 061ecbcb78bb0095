// Robot descriptions (URDF): their joints, and where these move what hangs from them. This and
// urdf_shape are the places that know urdfdom.
#ifndef STRATA_CLIENT_FORMATS_SHAPES_URDF_MODEL_H_
#define STRATA_CLIENT_FORMATS_SHAPES_URDF_MODEL_H_

#include <string>

#include "absl/status/statusor.h"
#include <urdf_model/model.h>
#include <urdf_world/types.h>

#include "core/geometry/pose.h"

namespace strata {

// NOT_FOUND, UNAVAILABLE; INVALID_ARGUMENT if the file is no robot description.
absl::StatusOr<urdf::ModelInterfaceSharedPtr> ReadUrdf(const std::string& file);

Pose PoseOf(const urdf::Pose& pose);

// T_parent_child of a joint at a position [rad or m] (thesis 4.3); of joints that are neither
// revolute, continuous nor prismatic at any position as at 0.
Pose JointTransform(const urdf::Joint& joint, double position);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SHAPES_URDF_MODEL_H_
