#include "core/mesh/distance_field.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/option_checks.h"
#include "core/common/status.h"
#include "core/mesh/marching_cubes.h"
#include "core/mesh/oriented_points.h"
#include "core/mesh/voxel_blocks.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

// Distances in voxels from here on.
constexpr double kTruncation = 4.0;  // beyond, a point says nothing of the surface
constexpr double kAlong = 1.25;      // σ of a point's weight along its normal
// A point speaks for this many spacings around it, at least and at most so many voxels.
constexpr double kReachSpacings = 1.5;
constexpr double kLeastReach = 1.5;
constexpr double kMostReach = 6.0;
// Points rougher than this may lie on no surface at all and speak for themselves only.
constexpr double kRough = 0.5;
// The largest weight of a point, at its place.
constexpr double kFullWeight = 256.0;
// Nodes that have less are at the fringe of what was seen.
constexpr std::uint16_t kLeastWeight = 48;
// Of points whose neighbours count the farthest is nearer: they are kMostReach apart at most.
constexpr double kAroundPart = 60.0;
// Surfaces seen flatter than this are the streaks of beams that two things share.
constexpr double kGrazing = 0.08;
// So much of a ray before its point is not called free: noise, and poses that are not exact.
constexpr double kMargin = 4.0;
// A ray through a node counts as much as this of a point at it; by depth behind the surface.
constexpr double kRayWeight = 96.0;
// A distance grows by one from node to node, by noise a little more.
constexpr float kSteepest = 2.0F;

struct Node {
  float sum = 0.0F;          // of weight · distance [voxels]
  std::uint16_t weight = 0;  // halved with the sum when full: later scans then count more
  std::uint16_t free = 0;    // of rays, saturated
};
static_assert(sizeof(Node) == 8);

constexpr std::uint16_t kFull = 0xFFFF;

void AddTo(Node& node, double distance, double weight) {
  const auto units = static_cast<std::uint16_t>(weight);
  if (units == 0) return;
  if (node.weight > kFull - units) {
    node.weight = static_cast<std::uint16_t>(node.weight / 2);
    node.sum *= 0.5F;
  }
  node.weight = static_cast<std::uint16_t>(node.weight + units);
  node.sum += static_cast<float>(units * distance);
}

float DistanceAt(const Node& node) {
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  if (node.weight < kLeastWeight || (node.sum < 0.0F && node.free > node.weight)) return kUnknown;
  return node.sum / static_cast<float>(node.weight);
}

// Of a ray in voxels, the stretch inside a box; empty if begin ≥ end.
struct Stretch {
  double begin, end;
};
Stretch Clip(const Vector3d& from,
             const Vector3d& along,
             Stretch stretch,
             const Eigen::AlignedBox3d& box) {
  for (int k = 0; k < 3; ++k) {
    const double a = (box.min()[k] - from[k]) / along[k];
    const double b = (box.max()[k] - from[k]) / along[k];
    if (along[k] == 0.0) {
      if (from[k] < box.min()[k] || from[k] > box.max()[k]) return {0.0, 0.0};
      continue;
    }
    stretch.begin = std::max(stretch.begin, std::min(a, b));
    stretch.end = std::min(stretch.end, std::max(a, b));
  }
  return stretch;
}

}  // namespace

absl::Status DistanceFieldOptions::Validate() const {
  OptionChecks checks("distance field");
  checks.InRange("voxel_m", voxel_m, 0.001, 10.0);
  for (const Vector3d& corner : {region.min(), region.max()}) {
    for (const double x : corner) checks.InRange("region", x, -1e9, 1e9);
  }
  return checks.status();
}

class DistanceField::Field {
 public:
  explicit Field(const DistanceFieldOptions& options) : options_(options) {
    grid_.spacing_m = options.voxel_m;
    if (!options.part.has_value()) return;
    grid_.origin = options.part->origin;
    placed_ = true;
    const auto [low, high] = options.part->blocks;
    low_ = kBlockEdge * Vector3i(low.x, low.y, low.z);
    high_ = kBlockEdge * Vector3i(high.x, high.y, high.z);
  }

  absl::Status Add(const PointCloud& cloud,
                   const Pose& T_map_scan,
                   const SensorModel& sensor,
                   const Stop& stop) {
    Place(cloud, T_map_scan);
    points_ += CountInRegion(cloud, T_map_scan);
    std::size_t done = 0;
    const std::optional<PointCloud> near = NearPart(cloud, T_map_scan);
    for (const OrientedPoint& point : OrientPoints(near.value_or(cloud), options_.voxel_m)) {
      if (done++ % 1024 == 0) STRATA_RETURN_IF_ERROR(Check(stop));
      const double range_m = (point.position - cloud.sensor_origin).norm();
      if (!sensor.Takes(range_m)) continue;
      const Vector3d position = T_map_scan * (point.position.cast<double>() + cloud.origin);
      if (!options_.region.contains(position)) continue;
      const Vector3d at = grid_.InNodes(position);
      if (!(at.cwiseAbs().maxCoeff() < kMostNodes)) return TooFar();
      const double cosine = point.normal.dot(cloud.sensor_origin - point.position) / range_m;
      if (cosine < kGrazing) continue;
      // Relative to a sensor that stands before it; noise across the voxel counts the same.
      // Nothing joins points so far apart.
      if (point.spacing_m > kMostReach * options_.voxel_m) continue;
      const bool rough = point.roughness_m > kRough * options_.voxel_m + sensor.SigmaAt(range_m);
      const double sigma_m = std::hypot(sensor.SigmaAt(range_m), double{point.roughness_m});
      const double weight = 1.0 / (1.0 + std::pow(sigma_m / options_.voxel_m, 2));
      Splat(at,
            T_map_scan.linear() * point.normal.cast<double>(),
            rough ? 0.0 : point.spacing_m / options_.voxel_m,
            kFullWeight * weight * std::min(1.0, cosine + 0.25));
    }
    return Check(stop);
  }

  absl::Status Carve(const PointCloud& cloud,
                     const Pose& T_map_scan,
                     const SensorModel& sensor,
                     const Stop& stop) {
    const Vector3d from =
        grid_.InNodes(T_map_scan * (cloud.sensor_origin.cast<double>() + cloud.origin));
    const Eigen::AlignedBox3d region = Eigen::AlignedBox3d(grid_.InNodes(options_.region.min()),
                                                           grid_.InNodes(options_.region.max()))
                                           .intersection({low_.cast<double>() - Vector3d::Ones(),
                                                          high_.cast<double>() + Vector3d::Ones()});
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (i % 1024 == 0) STRATA_RETURN_IF_ERROR(stop.status());
      const Eigen::Vector3f& p = cloud.points[i];
      if (!p.allFinite() || !sensor.Takes((p - cloud.sensor_origin).norm())) continue;
      const Vector3d ray = grid_.InNodes(T_map_scan * (p.cast<double>() + cloud.origin)) - from;
      const double length = ray.norm();
      if (!(length > kMargin && std::isfinite(length))) continue;
      const Vector3d along = ray / length;
      CarveRay(from, along, Clip(from, along, {0.0, length - kMargin}, region));
    }
    return stop.status();
  }

  absl::StatusOr<TriangleMesh> Mesh(const Stop& stop) const {
    STRATA_ASSIGN_OR_RETURN(
        TriangleMesh mesh,
        MarchCubes(
            voxels_.keys(),
            [this](std::size_t i, std::size_t node) { return DistanceAt(voxels_.block(i)[node]); },
            std::numeric_limits<float>::quiet_NaN(),
            kSteepest,
            grid_,
            stop,
            options_.part.has_value() ? &options_.part->blocks : nullptr));
    if (!options_.part.has_value()) DropSmallParts(kLeastMeshPart, mesh);
    return mesh;
  }

  std::uint64_t points() const { return points_; }
  std::size_t bytes() const { return voxels_.bytes(); }

 private:
  // The first scan says where the nodes are, so that they are whole numbers anywhere.
  void Place(const PointCloud& cloud, const Pose& T_map_scan) {
    if (placed_) return;
    grid_.origin = OriginFor(cloud, T_map_scan, options_.voxel_m);
    placed_ = true;
  }

  std::uint64_t CountInRegion(const PointCloud& cloud, const Pose& T_map_scan) const {
    return static_cast<std::uint64_t>(
        std::count_if(cloud.points.begin(), cloud.points.end(), [&](const Eigen::Vector3f& p) {
          return p.allFinite() &&
                 options_.region.contains(T_map_scan * (p.cast<double>() + cloud.origin));
        }));
  }

  // Of a part what its surface may depend on; nullopt: all of the cloud.
  std::optional<PointCloud> NearPart(const PointCloud& cloud, const Pose& T_map_scan) const {
    if (!options_.part.has_value()) return std::nullopt;
    const Eigen::AlignedBox3d around(low_.cast<double>() - Vector3d::Constant(kAroundPart),
                                     high_.cast<double>() + Vector3d::Constant(kAroundPart));
    PointCloud near;
    near.origin = cloud.origin;
    near.sensor_origin = cloud.sensor_origin;
    std::copy_if(cloud.points.begin(),
                 cloud.points.end(),
                 std::back_inserter(near.points),
                 [&](const Eigen::Vector3f& p) {
                   return p.allFinite() && around.contains(grid_.InNodes(
                                               T_map_scan * (p.cast<double>() + cloud.origin)));
                 });
    return near;
  }

  absl::Status TooFar() const {
    return absl::OutOfRangeError(
        absl::StrFormat("a point lies more than 10⁹ voxels of %g m from the first scan: mesh a "
                        "region of the map, or "
                        "with larger voxels",
                        options_.voxel_m));
  }

  absl::Status Check(const Stop& stop) const {
    if (bytes() <= options_.max_bytes) return stop.status();
    return absl::ResourceExhaustedError(absl::StrFormat(
        "the surfaces need more than %d MiB of voxels of %g m: mesh a smaller region, or with "
        "larger voxels",
        options_.max_bytes >> 20,
        options_.voxel_m));
  }

  // Nodes near a point on its plane get their distance to it, positive along `normal`.
  void Splat(const Vector3d& at, const Vector3d& normal, double spacing, double weight) {
    const double reach = std::clamp(kReachSpacings * spacing, kLeastReach, kMostReach);
    // The box around a disc of that radius and a stick through it.
    const Vector3d half = (kTruncation * normal.cwiseAbs().array() +
                           reach * (1.0 - normal.array().square()).max(0.0).sqrt())
                              .matrix();
    const Vector3i low = (at - half).array().ceil().cast<int>().max(low_.array());
    const Vector3i high = (at + half).array().floor().cast<int>().min(high_.array());
    const double across = 2.0 / (reach * reach);
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int x = low.x(); x <= high.x(); ++x) {
          const Vector3i node(x, y, z);
          const Vector3d d = node.cast<double>() - at;
          const double distance = normal.dot(d);
          const double aside = d.squaredNorm() - distance * distance;
          if (std::abs(distance) > kTruncation || aside > reach * reach) continue;
          const double share =
              std::exp(-0.5 * distance * distance / (kAlong * kAlong) - across * aside);
          AddTo(voxels_.FindOrAdd(BlockOf(node))[NodeInBlock(node)], distance, weight * share);
        }
      }
    }
  }

  // Tells nodes behind a surface that a ray went through them. Looks at whole voxels from the
  // sensor, so that neither blocks nor parts decide where.
  void CarveRay(const Vector3d& from, const Vector3d& along, const Stretch& stretch) {
    for (double t = std::ceil(stretch.begin); t < stretch.end;) {
      const Vector3d at = from + t * along;
      const Vector3i node = at.array().round().cast<int>();
      const BlockKey key = BlockOf(node);
      if (auto* const block = voxels_.Find(key)) {
        Node& seen = (*block)[NodeInBlock(node)];
        if (seen.sum < 0.0F && seen.weight > 0) {
          const double depth = -double{seen.sum} / seen.weight;
          seen.free = static_cast<std::uint16_t>(
              std::min(double{kFull}, seen.free + kRayWeight * std::min(1.0, depth / 2.0)));
        }
        t += 1.0;
      } else {
        t = std::max(t + 1.0, std::ceil(t + ToNextBlock(at, along, key)));
      }
    }
  }

  static double ToNextBlock(const Vector3d& at, const Vector3d& along, const BlockKey& key) {
    const Vector3d low = Vector3d(key.x, key.y, key.z) * kBlockEdge - Vector3d::Constant(0.5);
    double step = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      if (along[k] == 0.0) continue;
      const double border = along[k] > 0.0 ? low[k] + kBlockEdge : low[k];
      step = std::min(step, (border - at[k]) / along[k]);
    }
    return step;
  }

  const DistanceFieldOptions options_;
  NodeGrid grid_;
  bool placed_ = false;
  // Nodes beyond are not represented, or of no interest.
  Vector3i low_ = Vector3i::Constant(static_cast<int>(-kMostNodes));
  Vector3i high_ = Vector3i::Constant(static_cast<int>(kMostNodes));
  VoxelBlocks<Node> voxels_;
  std::uint64_t points_ = 0;
};

DistanceField::DistanceField(const DistanceFieldOptions& options)
    : field_(std::make_unique<Field>(options)) {}
DistanceField::~DistanceField() = default;
DistanceField::DistanceField(DistanceField&&) noexcept = default;

absl::Status DistanceField::Add(const PointCloud& cloud,
                                const Pose& T_map_scan,
                                const SensorModel& sensor,
                                const Stop& stop) {
  return field_->Add(cloud, T_map_scan, sensor, stop);
}
absl::Status DistanceField::Carve(const PointCloud& cloud,
                                  const Pose& T_map_scan,
                                  const SensorModel& sensor,
                                  const Stop& stop) {
  return field_->Carve(cloud, T_map_scan, sensor, stop);
}
std::uint64_t DistanceField::points() const { return field_->points(); }
std::size_t DistanceField::bytes() const { return field_->bytes(); }
Eigen::Vector3d DistanceField::OriginFor(const PointCloud& cloud,
                                         const Pose& T_map_scan,
                                         double voxel_m) {
  return (T_map_scan * cloud.origin / voxel_m).array().round() * voxel_m;
}
absl::StatusOr<TriangleMesh> DistanceField::Mesh(const Stop& stop) const {
  return field_->Mesh(stop);
}

}  // namespace strata
