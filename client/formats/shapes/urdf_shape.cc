#include "client/formats/shapes/urdf_shape.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/strip.h"
#include <urdf_model/model.h>

#include "client/formats/shapes/mesh_shape.h"
#include "client/formats/shapes/urdf_model.h"
#include "core/common/status.h"
#include "core/geometry/pose.h"

namespace strata {
namespace {

class UrdfShape {
 public:
  UrdfShape(std::filesystem::path folder, const JointPositions& joints)
      : folder_(std::move(folder)), joints_(joints) {}

  absl::Status Add(const urdf::Link& link, const Pose& T_root_link) {
    for (const urdf::CollisionSharedPtr& collision : link.collision_array) {
      if (collision == nullptr || collision->geometry == nullptr) continue;
      STRATA_RETURN_IF_ERROR(
          AddGeometry(*collision->geometry, T_root_link * PoseOf(collision->origin)));
    }
    for (const urdf::JointSharedPtr& joint : link.child_joints) {
      const urdf::LinkConstSharedPtr child = FindChild(link, *joint);
      if (child == nullptr) continue;
      STRATA_RETURN_IF_ERROR(Add(*child, T_root_link * MovedBy(*joint)));
    }
    return absl::OkStatus();
  }

  CollisionShape shape() && { return std::move(shape_); }

 private:
  static urdf::LinkConstSharedPtr FindChild(const urdf::Link& link, const urdf::Joint& joint) {
    for (const urdf::LinkSharedPtr& child : link.child_links) {
      if (child->name == joint.child_link_name) return child;
    }
    return nullptr;
  }

  Pose MovedBy(const urdf::Joint& joint) const {
    const auto found = joints_.find(joint.name);
    return JointTransform(joint, found == joints_.end() ? 0.0 : found->second);
  }

  absl::Status AddGeometry(const urdf::Geometry& geometry, const Pose& T) {
    ShapePart part;
    part.T_shape_part = T;
    if (const auto* box = dynamic_cast<const urdf::Box*>(&geometry)) {
      part.size_m = {box->dim.x, box->dim.y, box->dim.z};
    } else if (const auto* cylinder = dynamic_cast<const urdf::Cylinder*>(&geometry)) {
      part.kind = ShapePart::Kind::kCylinder;
      part.size_m = {cylinder->radius, 0.0, cylinder->length};
    } else if (const auto* sphere = dynamic_cast<const urdf::Sphere*>(&geometry)) {
      part.kind = ShapePart::Kind::kSphere;
      part.size_m = {sphere->radius, 0.0, 0.0};
    } else if (const auto* mesh = dynamic_cast<const urdf::Mesh*>(&geometry)) {
      const Eigen::Affine3d scaled =
          T * Eigen::Scaling(mesh->scale.x, mesh->scale.y, mesh->scale.z);
      STRATA_ASSIGN_OR_RETURN(const std::string file, FileOf(mesh->filename));
      return AddMeshFile(file, scaled, shape_);
    }
    shape_.parts.push_back(part);
    return absl::OkStatus();
  }

  // package://robot/meshes/a.stl is robot/meshes/a.stl or meshes/a.stl in a folder above the file.
  absl::StatusOr<std::string> FileOf(const std::string& name) const {
    absl::string_view inside = name;
    const bool package = absl::ConsumePrefix(&inside, "package://");
    absl::ConsumePrefix(&inside, "file://");
    const std::filesystem::path path((std::string(inside)));
    std::filesystem::path in_package;
    for (auto part = path.begin(); part != path.end(); ++part) {
      if (part != path.begin()) in_package /= *part;
    }
    for (std::filesystem::path above = folder_; !above.empty(); above = above.parent_path()) {
      if (std::filesystem::is_regular_file(above / path)) return (above / path).string();
      if (package && std::filesystem::is_regular_file(above / in_package)) {
        return (above / in_package).string();
      }
      if (!package || above == above.parent_path()) break;
    }
    return absl::NotFoundError(absl::StrCat(name, " is not beside the robot description"));
  }

  const std::filesystem::path folder_;
  const JointPositions& joints_;
  CollisionShape shape_;
};

absl::Status CheckJoints(const urdf::ModelInterface& model, const JointPositions& joints) {
  for (const auto& [name, position] : joints) {
    if (model.joints_.count(name) != 0) continue;
    std::vector<std::string> known;
    for (const auto& [joint, unused] : model.joints_) known.push_back(joint);
    return absl::InvalidArgumentError(absl::StrCat(
        "robot ", model.name_, " has no joint ", name, "; it has ", absl::StrJoin(known, ", ")));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<CollisionShape> ReadUrdfShape(const std::string& file,
                                             const JointPositions& joints) {
  STRATA_ASSIGN_OR_RETURN(const urdf::ModelInterfaceSharedPtr model, ReadUrdf(file));
  STRATA_RETURN_IF_ERROR(CheckJoints(*model, joints));
  UrdfShape shape(std::filesystem::absolute(file).parent_path(), joints);
  STRATA_RETURN_IF_ERROR(shape.Add(*model->getRoot(), Pose::Identity()));
  CollisionShape read = std::move(shape).shape();
  if (read.parts.empty() && read.triangles.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(file, ": no link has collision geometry"));
  }
  return read;
}

}  // namespace strata
