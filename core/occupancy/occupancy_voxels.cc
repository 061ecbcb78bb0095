#include "core/occupancy/occupancy_voxels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "absl/strings/str_format.h"

#include "core/common/option_checks.h"
#include "core/common/status.h"
#include "core/occupancy/voxel_walk.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

std::int16_t OddsOf(double probability) {
  return static_cast<std::int16_t>(
      std::lround(OccupancyVoxels::kOddsPerNat * std::log(probability / (1.0 - probability))));
}

constexpr std::size_t kMostBytes = 2'000'000'000;
constexpr std::uint16_t kLastScan = 32'767;
constexpr std::size_t kRaysBetweenChecks = 1024;

}  // namespace

absl::Status OccupancyVoxelsOptions::Validate() const {
  OptionChecks checks("occupancy");
  checks.InRange("voxel_m", voxel_m, 0.001, 1000.0);
  checks.InRange("farthest_voxel", farthest_voxel, 1.0, kMostNodes);
  checks.InRange("least", model.least, 0.01, 0.49);
  checks.InRange("most", model.most, 0.51, 0.99);
  checks.InRange("hit", model.hit, 0.51, model.most);
  checks.InRange("miss", model.miss, model.least, 0.49);
  for (const Vector3d& corner : {region.min(), region.max()}) {
    for (const double x : corner) checks.InRange("region", x, -1e9, 1e9);
  }
  return checks.status();
}

OccupancyVoxels::OccupancyVoxels(const OccupancyVoxelsOptions& options)
    : voxel_m_(options.voxel_m),
      farthest_voxel_(options.farthest_voxel),
      hit_(OddsOf(options.model.hit)),
      miss_(OddsOf(options.model.miss)),
      least_(OddsOf(options.model.least)),
      most_(OddsOf(options.model.most)),
      hits_stay_(options.model.hits_stay),
      kept_(options.region, options.voxel_m) {}

void OccupancyVoxels::BeginScan() {
  if (++scan_ <= kLastScan) return;
  voxels_.ForEach([](Voxel& voxel) { voxel.seen = std::min<std::uint16_t>(voxel.seen, 1); });
  scan_ = 1;
}

absl::Status OccupancyVoxels::Check(const Stop& stop) const {
  if (bytes() <= kMostBytes) return stop.status();
  return absl::ResourceExhaustedError(
      absl::StrFormat("occupancy: more than %d MB; take larger voxels or a smaller region",
                      kMostBytes / 1'000'000));
}

// True the first time that the scan hits it.
bool OccupancyVoxels::Hit(const Vector3i& at, double z) {
  Voxel& voxel = At(at);
  if (hits_stay_) heights_.FindOrAdd(BlockOf(at))[NodeInBlock(at)].Add(z);
  const auto mark = static_cast<std::uint16_t>(2 * scan_ + 1);
  if (voxel.seen == mark) return false;
  voxel.seen = mark;
  voxel.odds = After(voxel.odds, true);
  return true;
}

// The same of what it looks through.
bool OccupancyVoxels::Miss(const Vector3i& at) {
  Voxel& voxel = At(at);
  const auto mark = static_cast<std::uint16_t>(2 * scan_);
  if (hits_stay_ && voxel.odds > 0) heights_.FindOrAdd(BlockOf(at))[NodeInBlock(at)].passed = true;
  if (voxel.seen >= mark) return false;
  voxel.seen = mark;
  voxel.odds = After(voxel.odds, false);
  return true;
}

// Leaves the part over the voxels that are kept; false if there is none.
bool OccupancyVoxels::Clip(Ray& ray) const {
  const Vector3d along = ray.to - ray.from;
  double begin = 0.0;
  double end = 1.0;
  for (int i = 0; i < 3; ++i) {
    if (along[i] == 0.0) {
      if (ray.from[i] < kept_.low[i] || ray.from[i] >= kept_.high[i]) return false;
      continue;
    }
    const double a = (kept_.low[i] - ray.from[i]) / along[i];
    const double b = (kept_.high[i] - ray.from[i]) / along[i];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  if (begin >= end) return false;
  ray.ends = ray.hits && end == 1.0;
  ray.to = ray.from + end * along;
  ray.from += begin * along;
  return true;
}

void OccupancyVoxels::Cast(const Ray& ray) {
  const Vector3i last = VoxelOf(ray.to);
  WalkVoxels(
      ray.from, ray.to, Nearest(VoxelOf(ray.from)), [&](const Vector3i& at, double /*passed*/) {
        if (!Inside(at) || (ray.ends && at == last)) return false;
        Miss(at);
        return true;
      });
}

absl::Status OccupancyVoxels::Add(const PointCloud& cloud,
                                  const Pose& T_map_scan,
                                  const SensorModel& sensor,
                                  const Stop& stop) {
  BeginScan();
  const Vector3d from = T_map_scan * (cloud.sensor_origin.cast<double>() + cloud.origin) / voxel_m_;
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (i % kRaysBetweenChecks == 0) STRATA_RETURN_IF_ERROR(Check(stop));
    const Eigen::Vector3f& p = cloud.points[i];
    const double range_m = (p - cloud.sensor_origin).cast<double>().norm();
    const double seen_m = std::min(range_m, sensor.max_range_m);
    if (!p.allFinite() || !sensor.Takes(seen_m)) continue;
    Ray ray = {from, T_map_scan * (p.cast<double>() + cloud.origin) / voxel_m_};
    if (range_m > seen_m) {
      ray.to = from + seen_m / range_m * (ray.to - from);
      ray.hits = false;
    }
    if (!Clip(ray)) continue;
    if (std::max(ray.from.cwiseAbs().maxCoeff(), ray.to.cwiseAbs().maxCoeff()) >= farthest_voxel_) {
      return absl::OutOfRangeError(absl::StrFormat(
          "occupancy: a ray from (%.1f, %.1f, %.1f) leaves the %.1f m around 0 that voxels of "
          "%g m reach; take larger ones or a region near 0",
          from.x() * voxel_m_,
          from.y() * voxel_m_,
          from.z() * voxel_m_,
          farthest_voxel_ * voxel_m_,
          voxel_m_));
    }
    const Vector3i end = VoxelOf(ray.to);
    if (!ray.ends || !Inside(end) || Hit(end, ray.to.z())) rays.push_back(ray);
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (i % kRaysBetweenChecks == 0) STRATA_RETURN_IF_ERROR(Check(stop));
    // Of those that hit nothing, one where they end.
    if (rays[i].hits || Miss(Nearest(VoxelOf(rays[i].to)))) Cast(rays[i]);
  }
  return Check(stop);
}

OccupancyBlock OccupancyVoxels::block(std::size_t i) const {
  OccupancyBlock states;
  const auto state = [](const Voxel& voxel) {
    if (voxel.seen == 0) return Occupancy::kUnknown;
    return voxel.odds >= 0 ? Occupancy::kOccupied : Occupancy::kFree;
  };
  std::transform(voxels_.block(i).begin(), voxels_.block(i).end(), states.begin(), state);
  return states;
}

double OccupancyVoxels::ProbabilityOf(std::int16_t odds) {
  return odds == kUnknownOdds ? 0.5 : 1.0 / (1.0 + std::exp(-odds / kOddsPerNat));
}

std::size_t OccupancyVoxels::CountKnown(const Eigen::AlignedBox3d& region) const {
  const VoxelBox box(region, voxel_m_);
  std::size_t known = 0;
  for (std::size_t i = 0; i < keys().size(); ++i) {
    const Vector3i corner = kBlockEdge * Vector3i(keys()[i].x, keys()[i].y, keys()[i].z);
    for (int node = 0; node < static_cast<int>(kBlockNodes); ++node) {
      known += voxels_.block(i)[node].seen != 0 &&
               box.Contains(corner + Vector3i(node & 7, node >> 3 & 7, node >> 6));
    }
  }
  return known;
}

}  // namespace strata
