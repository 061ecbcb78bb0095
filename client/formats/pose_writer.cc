#include "client/formats/pose_writer.h"

#include <cstdint>
#include <span>
#include <string>

#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include <Eigen/Geometry>

namespace strata {

std::string TumText(std::span<const TimedPose> poses) {
  std::string text;
  for (const TimedPose& pose : poses) {
    Eigen::Quaterniond q(pose.T_map_scan.linear());
    q.normalize();
    if (q.w() < 0.0) q.coeffs() = -q.coeffs();
    const Eigen::Vector3d& t = pose.T_map_scan.translation();
    // In whole microseconds: a double would lose digits.
    const std::int64_t micros = absl::ToUnixMicros(pose.time);
    const std::uint64_t size =
        micros < 0 ? -static_cast<std::uint64_t>(micros) : static_cast<std::uint64_t>(micros);
    absl::StrAppendFormat(&text,
                          "%s%d.%06d %.12f %.12f %.12f %.12f %.12f %.12f %.12f\n",
                          micros < 0 ? "-" : "",
                          size / 1'000'000,
                          size % 1'000'000,
                          t.x(),
                          t.y(),
                          t.z(),
                          q.x(),
                          q.y(),
                          q.z(),
                          q.w());
  }
  return text;
}

}  // namespace strata
