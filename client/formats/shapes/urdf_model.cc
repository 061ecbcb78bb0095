#include "client/formats/shapes/urdf_model.h"

#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>
#include <urdf_parser/urdf_parser.h>

#include "client/formats/file_bytes.h"
#include "core/common/status.h"

namespace strata {

absl::StatusOr<urdf::ModelInterfaceSharedPtr> ReadUrdf(const std::string& file) {
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(file));
  urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(bytes);
  if (model == nullptr || model->getRoot() == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat(file, " is no robot description (URDF)"));
  }
  return model;
}

Pose PoseOf(const urdf::Pose& pose) {
  const urdf::Rotation& q = pose.rotation;
  return MakePose(Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized(),
                  {pose.position.x, pose.position.y, pose.position.z});
}

Pose JointTransform(const urdf::Joint& joint, double position) {
  const Pose origin = PoseOf(joint.parent_to_joint_origin_transform);
  const Eigen::Vector3d axis(joint.axis.x, joint.axis.y, joint.axis.z);
  if (position == 0.0 || axis.isZero()) return origin;
  switch (joint.type) {
    case urdf::Joint::REVOLUTE:
    case urdf::Joint::CONTINUOUS:
      return origin * Pose(Eigen::AngleAxisd(position, axis.normalized()));
    case urdf::Joint::PRISMATIC:
      return origin * Pose(Eigen::Translation3d(position * axis.normalized()));
    default:
      return origin;
  }
}

}  // namespace strata
