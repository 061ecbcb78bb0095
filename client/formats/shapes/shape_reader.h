// Shapes of robots out of files: meshes and robot descriptions.
#ifndef STRATA_CLIENT_FORMATS_SHAPES_SHAPE_READER_H_
#define STRATA_CLIENT_FORMATS_SHAPES_SHAPE_READER_H_

#include <map>
#include <string>

#include "absl/status/statusor.h"

#include "core/world/shape.h"

namespace strata {

// Positions of joints [rad, m]; those that are not there are at 0.
using JointPositions = std::map<std::string, double>;

// A shape in metres:
//   .stl .obj .ply .dae .glb  all meshes of the file, in its coordinates
//   .urdf                     the collision geometry of all links, in the frame of the root link;
//                             meshes beside the file, also by way of package://
// NOT_FOUND, INVALID_ARGUMENT with what is wrong.
absl::StatusOr<CollisionShape> ReadShape(const std::string& file,
                                         const JointPositions& joints = {});

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SHAPES_SHAPE_READER_H_
