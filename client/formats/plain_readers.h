// Files without a real header: text columns, KITTI's velodyne files and nuScenes', 3DTK's scans.
#ifndef STRATA_CLIENT_FORMATS_PLAIN_READERS_H_
#define STRATA_CLIENT_FORMATS_PLAIN_READERS_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata {

// Text, a point a line, separated by blanks, tabs, commas or semicolons. Names of the columns are
// taken from the first line that is no point, or from a comment line ('#' or "//" in front) in
// which "x", "y" and "z" follow each other. Without names the columns are x y z, x y z intensity, x
// y z red green blue or x y z intensity red green blue by their number; of any other number the
// first three count. INVALID_ARGUMENT with the line.
absl::StatusOr<PointCloud> ReadXyz(absl::string_view bytes);

// The same, of the Oakland 3-D point clouds (Munoz et al. 2009): without names the columns are x y
// z label confidence, and after them may come more that do not count.
absl::StatusOr<PointCloud> ReadOakland(absl::string_view bytes);

// x y z reflectance, float32 little-endian, metres, x forward, z up. INVALID_ARGUMENT unless the
// size is a multiple of 16, at most 1 % of the points are farther than 300 m or not finite, and the
// numbers do not have nuScenes' rings: files of other columns have the same ending, and often such
// sizes.
absl::StatusOr<PointCloud> ReadKitti(absl::string_view bytes);

// The same of nuScenes, a multiple of 20: x y z intensity ring; x right, y forward.
absl::StatusOr<PointCloud> ReadNuscenes(absl::string_view bytes);

// 3DTK's uos scans: "x y z …" a line in centimetres, left-handed (x right, y up, z forward); a
// fourth number is reflectance. Converted to metres, right-handed, x forward, y left, z up:
// p = M p_3dtk with M = 0.01 · [0 0 1; −1 0 0; 0 1 0]. Returns beyond the sensor's range stay: it
// is the sensor model that says what counts.
absl::StatusOr<PointCloud> Read3dtk(absl::string_view bytes);

// 3DTK's .pose file of a scan: "x y z" in centimetres, then angles about x, y, z in degrees, with
// p_world = Rx Ry Rz p + t, all left-handed. As the pose of the converted scan in the converted
// world: M R M⁻¹, M t. INVALID_ARGUMENT with the line.
absl::StatusOr<Pose> Parse3dtkPose(absl::string_view text);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PLAIN_READERS_H_
