// Poses of KITTI's odometry benchmark, which are those of a camera in the frame of its first.
#ifndef STRATA_CLIENT_FORMATS_CAMERA_POSES_H_
#define STRATA_CLIENT_FORMATS_CAMERA_POSES_H_

#include <filesystem>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"

#include "client/formats/pose_reader.h"
#include "core/geometry/pose.h"

namespace strata {

// Whether what moved looked along its z, as cameras on cars do and lidars do not: more than twice
// as far along that as across.
bool MoveAsCameras(const std::vector<FilePose>& in_order);

// T_camera_lidar of the "Tr" (odometry) or "Tr_velo_to_cam" (objects) of the first calib.txt in
// these folders; none where no such file has one. Errors name the file and the line.
absl::StatusOr<std::optional<Pose>> LidarInCamera(
    const std::vector<std::filesystem::path>& folders);

// Those of the lidar in the frame of its own first, where camera and lidar are fixed to each other.
std::vector<FilePose> PosesOfLidar(std::vector<FilePose> of_camera, const Pose& T_camera_lidar);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_CAMERA_POSES_H_
