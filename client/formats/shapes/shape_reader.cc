#include "client/formats/shapes/shape_reader.h"

#include <filesystem>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

#include "client/formats/shapes/mesh_shape.h"
#include "client/formats/shapes/urdf_shape.h"
#include "core/common/status.h"

namespace strata {

absl::StatusOr<CollisionShape> ReadShape(const std::string& file, const JointPositions& joints) {
  const std::string ending =
      absl::AsciiStrToLower(std::filesystem::path(file).extension().string());
  if (ending == ".urdf") return ReadUrdfShape(file, joints);
  if (!joints.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        file, " is a mesh and has no joints; they are of a robot description (.urdf)"));
  }
  for (const char* known : {".stl", ".obj", ".ply", ".dae", ".glb"}) {
    if (ending != known) continue;
    CollisionShape shape;
    STRATA_RETURN_IF_ERROR(AddMeshFile(file, Eigen::Affine3d::Identity(), shape));
    return shape;
  }
  return absl::InvalidArgumentError(
      absl::StrCat(file, ": shapes are .stl, .obj, .ply, .dae, .glb or .urdf files"));
}

}  // namespace strata
