#include "client/formats/camera_poses.h"

#include <string>
#include <system_error>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "client/formats/file_bytes.h"
#include "client/formats/parsing/text_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

// Of a file's text; none where no line begins with a name that is looked for.
absl::StatusOr<std::optional<Pose>> LidarInCameraOf(absl::string_view text) {
  TextCursor cursor(text);
  while (const std::optional<absl::string_view> line = cursor.NextLine()) {
    const std::vector<absl::string_view> words = SplitWords(*line);
    if (words.empty() || (words[0] != "Tr:" && words[0] != "Tr_velo_to_cam:")) continue;
    return ParseKittiPose(cursor, {words.begin() + 1, words.end()});
  }
  return std::nullopt;
}

}  // namespace

bool MoveAsCameras(const std::vector<FilePose>& in_order) {
  Eigen::Vector3d way_m = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i < in_order.size(); ++i) {
    const Pose step = in_order[i - 1].T_map_scan.inverse() * in_order[i].T_map_scan;
    way_m += step.translation().cwiseAbs();
  }
  return way_m.z() > 2.0 * way_m.head<2>().norm();
}

absl::StatusOr<std::optional<Pose>> LidarInCamera(
    const std::vector<std::filesystem::path>& folders) {
  for (const std::filesystem::path& folder : folders) {
    const std::filesystem::path file = folder / "calib.txt";
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) continue;
    STRATA_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(file));
    const absl::StatusOr<std::optional<Pose>> found = LidarInCameraOf(text);
    if (!found.ok()) return Annotate(found.status(), file.string());
    if (found->has_value()) return found;
  }
  return std::nullopt;
}

std::vector<FilePose> PosesOfLidar(std::vector<FilePose> of_camera, const Pose& T_camera_lidar) {
  const Pose T_lidar_camera = T_camera_lidar.inverse();
  for (FilePose& pose : of_camera) {
    pose.T_map_scan = Normalized(T_lidar_camera * pose.T_map_scan * T_camera_lidar);
  }
  return of_camera;
}

}  // namespace strata
