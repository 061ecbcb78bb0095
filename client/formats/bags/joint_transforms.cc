#include "client/formats/bags/joint_transforms.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "client/formats/bags/ros_messages.h"
#include "client/formats/shapes/urdf_model.h"
#include "core/common/status.h"
#include "core/geometry/pose.h"

namespace strata {
namespace {

bool Moves(const urdf::Joint& joint) {
  return joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS ||
         joint.type == urdf::Joint::PRISMATIC;
}

RosPose TransformOf(const urdf::Joint& joint, double position, std::int64_t stamp_ns) {
  const Pose T_parent_child = JointTransform(joint, position);
  const Eigen::Vector3d t = T_parent_child.translation();
  const Eigen::Quaterniond q(T_parent_child.linear());
  RosPose transform;
  transform.header = {.stamp_ns = stamp_ns, .frame = joint.parent_link_name};
  transform.child_frame = joint.child_link_name;
  transform.position_m = {t.x(), t.y(), t.z()};
  transform.quaternion = {q.x(), q.y(), q.z(), q.w()};
  return transform;
}

}  // namespace

absl::StatusOr<JointTransforms> JointTransforms::Read(const std::string& urdf_file) {
  STRATA_ASSIGN_OR_RETURN(const urdf::ModelInterfaceSharedPtr model, ReadUrdf(urdf_file));
  return JointTransforms(model);
}

std::vector<RosPose> JointTransforms::Fixed() const {
  std::vector<RosPose> transforms;
  for (const auto& [name, joint] : model_->joints_) {
    if (joint->type == urdf::Joint::FIXED) transforms.push_back(TransformOf(*joint, 0.0, 0));
  }
  return transforms;
}

std::vector<RosPose> JointTransforms::At(const RosJointState& state) const {
  std::map<std::string, double> positions;
  for (std::size_t i = 0; i < state.positions.size(); ++i) {
    positions[state.names[i]] = state.positions[i];
  }
  std::vector<RosPose> transforms;
  for (const auto& [name, joint] : model_->joints_) {
    if (!Moves(*joint)) continue;
    const urdf::JointMimic* const mimic = joint->mimic.get();
    const auto found = positions.find(mimic != nullptr ? mimic->joint_name : name);
    if (found == positions.end()) continue;
    const double position =
        mimic != nullptr ? mimic->multiplier * found->second + mimic->offset : found->second;
    transforms.push_back(TransformOf(*joint, position, state.header.stamp_ns));
  }
  return transforms;
}

std::set<std::string> JointTransforms::Moving() const {
  std::set<std::string> moving;
  for (const auto& [name, joint] : model_->joints_) {
    if (Moves(*joint)) moving.insert(joint->mimic != nullptr ? joint->mimic->joint_name : name);
  }
  return moving;
}

}  // namespace strata
