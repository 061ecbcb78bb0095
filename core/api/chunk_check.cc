#include "core/api/chunk_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "core/api/scans.h"
#include "core/common/status.h"
#include "core/world/map_class.h"

namespace strata::api {
namespace {

constexpr float kMaxCoordinateM = 1e6F;

absl::Status CheckColumn(const char* name, std::size_t entries, bool announced, std::size_t n) {
  if (entries == (announced ? n : 0)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("chunk: ",
                                                 name,
                                                 " has ",
                                                 entries,
                                                 " entries for ",
                                                 n,
                                                 " points; the header announced ",
                                                 announced ? "the column" : "no such column"));
}

bool IsWithin(const Eigen::Vector3f& p) { return (p.array().abs() <= kMaxCoordinateM).all(); }

// Without a branch a point, so that the compiler makes vectors of it; NaN is not within.
bool AllWithin(const std::vector<Eigen::Vector3f>& points) {
  const auto* const numbers = reinterpret_cast<const float*>(points.data());
  bool within = true;
  for (std::size_t i = 0; i < 3 * points.size(); ++i) {
    within &= std::abs(numbers[i]) <= kMaxCoordinateM;
  }
  return within;
}

absl::Status CheckPoints(const std::vector<Eigen::Vector3f>& points,
                         bool organised,
                         std::uint64_t first) {
  if (AllWithin(points)) return absl::OkStatus();
  const auto wrong = std::find_if(points.begin(), points.end(), [&](const Eigen::Vector3f& p) {
    return !IsWithin(p) && !(organised && p.array().isNaN().all());
  });
  if (wrong == points.end()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("point ",
                   first + static_cast<std::uint64_t>(wrong - points.begin()),
                   " (",
                   wrong->x(),
                   ", ",
                   wrong->y(),
                   ", ",
                   wrong->z(),
                   ") is not within ±1e6 m"));
}

}  // namespace

absl::Status CheckChunk(const PointCloud& chunk, const ScanHeader& header, std::uint64_t first) {
  const std::size_t n = chunk.size();
  if (n < 1 || n > kMaxPointsPerChunk) {
    return absl::InvalidArgumentError(
        absl::StrCat("chunk has ", n, " points: send 1 to ", kMaxPointsPerChunk));
  }
  if (!chunk.origin.isZero(0.0)) {
    return absl::InvalidArgumentError("chunk with an origin; fold it into the pose");
  }
  if (first > header.point_count || n > header.point_count - first) {
    return absl::InvalidArgumentError(
        absl::StrCat(first + n, " points arrived, the header announced ", header.point_count));
  }
  STRATA_RETURN_IF_ERROR(CheckColumn("intensity", chunk.intensity.size(), header.has_intensity, n));
  STRATA_RETURN_IF_ERROR(CheckColumn("colour", chunk.colour.size(), header.has_colour, n));
  STRATA_RETURN_IF_ERROR(CheckColumn("label", chunk.label.size(), header.has_label, n));
  STRATA_RETURN_IF_ERROR(ValidateLabels(chunk.label, first));
  return CheckPoints(chunk.points, header.rows != 0, first);
}

}  // namespace strata::api
