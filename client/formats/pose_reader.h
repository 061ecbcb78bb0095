// Poses of scans out of the files that SLAM programs and data sets write.
#ifndef STRATA_CLIENT_FORMATS_POSE_READER_H_
#define STRATA_CLIENT_FORMATS_POSE_READER_H_

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "client/formats/parsing/text_cursor.h"
#include "core/geometry/pose.h"

namespace strata {

// kTum: "time x y z qx qy qz qw". kIndexTum: "index time x y z qx qy qz qw". kKitti: the 12 numbers
// of [R t] row by row; the line's number, from 0, is the index. k3dtk: no file of poses, but a
// .pose file beside each scan. Metres, seconds; blanks, tabs or commas separate; '#' begins a
// comment line; names of columns may stand above the poses, and neither may say that qw comes
// first.
enum class PoseFormat : std::uint8_t { kAuto, kTum, kIndexTum, kKitti, k3dtk };

// "auto", "tum", "index-tum", "kitti", "3dtk"; INVALID_ARGUMENT listing them otherwise.
absl::StatusOr<PoseFormat> ParsePoseFormat(absl::string_view name);

struct FilePose {
  std::optional<std::uint64_t> index;  // of index-tum and kitti
  std::optional<absl::Time> time;      // of tum and index-tum, to the microsecond
  Pose T_map_scan = Pose::Identity();
};

struct PoseList {
  PoseFormat format = PoseFormat::kTum;  // never kAuto
  std::vector<FilePose> poses;           // in the file's order
};

// kAuto goes by the count of numbers in the first line: 8, 9 or 12. Quaternions within 1 % of unit
// length are normalised; KITTI's rotations, which are rounded, are made orthonormal. NOT_FOUND;
// INVALID_ARGUMENT with file, line and what was expected, also for an index that comes twice.
absl::StatusOr<PoseList> ReadPoses(const std::filesystem::path& path,
                                   PoseFormat format = PoseFormat::kAuto);

// The pose that twelve words of the line where `cursor` is are: rows of [R t]. INVALID_ARGUMENT
// naming that line.
absl::StatusOr<Pose> ParseKittiPose(const TextCursor& cursor,
                                    const std::vector<absl::string_view>& twelve);

// The pose beside a 3DTK scan: scan000.3d has scan000.pose. See Parse3dtkPose for the frame.
absl::StatusOr<Pose> Read3dtkPoseOf(const std::filesystem::path& scan);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_POSE_READER_H_
