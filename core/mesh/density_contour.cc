#include "core/mesh/density_contour.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/common/option_checks.h"
#include "core/common/status.h"
#include "core/geometry/eigen_solvers.h"
#include "core/mesh/marching_cubes.h"
#include "core/mesh/voxel_blocks.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr int kRadius = 2;  // voxels within which a point counts
constexpr double kShare = 0.99;
constexpr float kAnyStep = std::numeric_limits<float>::infinity();

using Counts = VoxelBlocks<std::uint16_t>;

// The axes of the points' spread as rows, right-handed, and their mean.
struct Box {
  Eigen::Matrix3d R_box_map;
  Vector3d mean;
};
Box PrincipalAxes(std::span<const Vector3d> points) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : points)
    mean += (p - points.front()) / static_cast<double>(points.size());
  mean += points.front();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  Eigen::Matrix3d R = solver.eigenvectors().transpose();
  if (R.determinant() < 0.0) R.row(0) *= -1.0;
  return {R, mean};
}

void Count(const Vector3d& at, Counts& counts) {
  const Vector3i middle = at.array().round().cast<int>();
  for (int z = -kRadius; z <= kRadius; ++z) {
    for (int y = -kRadius; y <= kRadius; ++y) {
      for (int x = -kRadius; x <= kRadius; ++x) {
        const Vector3i node = middle + Vector3i(x, y, z);
        if ((node.cast<double>() - at).squaredNorm() > kRadius * kRadius) continue;
        std::uint16_t& count = counts.FindOrAdd(BlockOf(node))[NodeInBlock(node)];
        count = static_cast<std::uint16_t>(std::min(count + 1, 0xFFFF));
      }
    }
  }
}

// What `kShare` of the nodes with points are not above.
double UsualMost(const Counts& counts) {
  std::vector<std::size_t> nodes_with(0x10000, 0);
  std::size_t nodes = 0;
  for (std::size_t b = 0; b < counts.size(); ++b) {
    for (const std::uint16_t count : counts.block(b)) {
      if (count == 0) continue;
      ++nodes_with[count];
      ++nodes;
    }
  }
  std::size_t below = 0;
  std::size_t count = 0;
  while (static_cast<double>(below) < kShare * static_cast<double>(nodes)) {
    below += nodes_with[++count];
  }
  return static_cast<double>(count);
}

}  // namespace

absl::Status DensityContourOptions::Validate() const {
  OptionChecks checks("density contour");
  checks.InRange("voxel_m", voxel_m, 0.001, 10.0);
  checks.InRange("threshold", threshold, 1e-6, 1.0 - 1e-6);
  return checks.status();
}

absl::StatusOr<TriangleMesh> ContourDensity(std::span<const Vector3d> points,
                                            const DensityContourOptions& options,
                                            const Stop& stop) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  if (points.empty()) return TriangleMesh();
  const Box box = PrincipalAxes(points);
  Counts counts;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d at = box.R_box_map * (points[i] - box.mean) / options.voxel_m;
    if (!(at.cwiseAbs().maxCoeff() < kMostNodes)) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "density contour: point %d is not finite, or beyond 10⁹ voxels of %g m from the others",
          i,
          options.voxel_m));
    }
    Count(at, counts);
    if (i % 1024 != 0) continue;
    STRATA_RETURN_IF_ERROR(stop.status());
    if (counts.bytes() <= options.max_bytes) continue;
    return absl::ResourceExhaustedError(absl::StrFormat(
        "the points need more than %d MiB of voxels of %g m: mesh a smaller region, or with larger "
        "voxels",
        options.max_bytes >> 20,
        options.voxel_m));
  }
  const double level = options.threshold * UsualMost(counts);
  const auto read = [&](std::size_t i, std::size_t node) {
    return static_cast<float>(level - counts.block(i)[node]);
  };
  const NodeGrid grid{.origin = Vector3d::Zero(), .spacing_m = options.voxel_m};
  STRATA_ASSIGN_OR_RETURN(
      TriangleMesh mesh,
      MarchCubes(counts.keys(), read, static_cast<float>(level), kAnyStep, grid, stop));
  for (Vector3d& v : mesh.vertices) v = box.R_box_map.transpose() * v + box.mean;
  return mesh;
}

}  // namespace strata
