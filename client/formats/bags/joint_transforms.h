// The links of a robot as frames: what robot_state_publisher of ROS makes of a robot description
// and of the positions of its joints.
#ifndef STRATA_CLIENT_FORMATS_BAGS_JOINT_TRANSFORMS_H_
#define STRATA_CLIENT_FORMATS_BAGS_JOINT_TRANSFORMS_H_

#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

#include "client/formats/bags/ros_messages.h"

namespace urdf {
class ModelInterface;
}  // namespace urdf

namespace strata {

// Transforms from a link to the next along the chain of joints (thesis 4.2 and 4.3), for a
// TransformTree, which multiplies them.
class JointTransforms {
 public:
  // Of a robot description (URDF). As ReadUrdf.
  static absl::StatusOr<JointTransforms> Read(const std::string& urdf_file);

  // Of the joints that never move: for all times.
  std::vector<RosPose> Fixed() const;
  // Of those that move and that the message has a position of; a joint that mimics another moves
  // with that one.
  std::vector<RosPose> At(const RosJointState& state) const;
  // Names of the joints whose positions are needed.
  std::set<std::string> Moving() const;

 private:
  explicit JointTransforms(std::shared_ptr<const urdf::ModelInterface> model)
      : model_(std::move(model)) {}
  std::shared_ptr<const urdf::ModelInterface> model_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_JOINT_TRANSFORMS_H_
