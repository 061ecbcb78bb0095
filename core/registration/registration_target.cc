#include "core/registration/registration_target.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>

#include "core/common/option_checks.h"
#include "core/registration/column_grid.h"
#include "core/registration/scan_features.h"

namespace strata {
namespace {

constexpr float kColumnSizeM = 0.4F;

// Points whose slots are fetched ahead: far enough for memory, near enough to stay in the cache.
constexpr std::size_t kAhead = 12;

struct Cube {
  std::uint64_t key = 0;
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  float count = 0.0F;
};

// The point's cube: 21 bits an axis.
std::uint64_t KeyOf(const Eigen::Vector3f& p, float cube_m) {
  const auto coordinate = [cube_m](float v) {
    const float cubes = v / cube_m;
    auto floor = static_cast<std::int64_t>(cubes);  // towards zero
    if (static_cast<float>(floor) > cubes) --floor;
    return static_cast<std::uint64_t>(floor) & 0x1FFFFF;
  };
  return coordinate(p.x()) | coordinate(p.y()) << 21 | coordinate(p.z()) << 42;
}

struct Averages {
  std::vector<Eigen::Vector3f> means;
  std::vector<std::uint32_t> mean_of;  // each point
};

// Averages points that share a cube. Open addressing over cube keys; cubes keep the order in which
// they are first seen, so the result depends on the points and their order only. The table is
// larger than caches, and which slot is next does not depend on those before.
Averages AverageInCubes(const std::vector<Eigen::Vector3f>& points, float cube_m) {
  Averages averages;
  averages.mean_of.resize(points.size());
  std::vector<std::uint64_t> keys(points.size());
  std::transform(points.begin(), points.end(), keys.begin(), [cube_m](const Eigen::Vector3f& p) {
    return KeyOf(p, cube_m);
  });
  std::vector<Cube> cubes;
  cubes.reserve(points.size() / 2);
  const std::size_t slots = std::bit_ceil(points.size() * 2 + 1);
  const int shift = 64 - std::countr_zero(slots);
  std::vector<std::uint32_t> table(slots, ColumnGrid::kNone);
  const auto slot_of = [&](std::uint64_t key) { return (key * 0x9E3779B97F4A7C15U) >> shift; };
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i + kAhead < points.size()) __builtin_prefetch(&table[slot_of(keys[i + kAhead])]);
    std::size_t slot = slot_of(keys[i]);
    while (table[slot] != ColumnGrid::kNone && cubes[table[slot]].key != keys[i]) {
      slot = (slot + 1) & (slots - 1);
    }
    if (table[slot] == ColumnGrid::kNone) {
      table[slot] = static_cast<std::uint32_t>(cubes.size());
      cubes.push_back({keys[i], points[i], 1.0F});
    } else {
      Cube& cube = cubes[table[slot]];
      cube.count += 1.0F;
      cube.mean += (points[i] - cube.mean) / cube.count;
    }
    averages.mean_of[i] = table[slot];
  }
  averages.means.resize(cubes.size());
  std::transform(
      cubes.begin(), cubes.end(), averages.means.begin(), [](const Cube& c) { return c.mean; });
  return averages;
}

// Features of one class in the grids' coordinates, scan after scan.
struct PlacedPoints {
  std::vector<Eigen::Vector3f> points;
  // Unit vectors to their sensors, zero for tops that were looked down to; empty if not asked for.
  std::vector<Eigen::Vector3f> toward;
};

PlacedPoints PlacePoints(std::span<const PlacedScan> scans,
                         FeatureClass c,
                         const Eigen::Vector3d& origin,
                         double radius_m,
                         bool with_sensors) {
  PlacedPoints placed;
  std::size_t most = 0;
  for (const PlacedScan& scan : scans) most += scan.features->points(c).size();
  placed.points.reserve(most);
  if (with_sensors) placed.toward.reserve(most);
  const auto radius_m2 = static_cast<float>(radius_m * radius_m);
  for (const PlacedScan& scan : scans) {
    const Eigen::Matrix3f R = scan.T_target_scan.linear().cast<float>();
    const Eigen::Vector3f t = (scan.T_target_scan.translation() - origin).cast<float>();
    const Eigen::Vector3f sensor =
        (scan.T_target_scan * scan.features->sensor_origin() - origin).cast<float>();
    for (const Eigen::Vector3f& p : scan.features->points(c)) {
      const Eigen::Vector3f moved = R * p + t;
      if (moved.head<2>().squaredNorm() > radius_m2) continue;
      placed.points.push_back(moved);
      if (!with_sensors) continue;
      const Eigen::Vector3f to_sensor = sensor - moved;
      const bool is_top = c == FeatureClass::kTraversable && to_sensor.z() >= 0.0F;
      placed.toward.push_back(is_top ? Eigen::Vector3f::Zero() : to_sensor.normalized());
    }
  }
  return placed;
}

// The first point of a cube says which side is the first.
void AddTo(SeenSides& sides, const Eigen::Vector3f& p, const Eigen::Vector3f& toward) {
  const bool is_first = sides[0].count == 0.0F || sides[0].toward.dot(toward) >= 0.0F;
  SeenSide& side = sides[is_first ? 0 : 1];
  side.count += 1.0F;
  side.mean += (p - side.mean) / side.count;
  side.toward += toward;
}

// In the order of a grid.
std::vector<SeenSides> UprightSidesOf(const PlacedPoints& placed,
                                      const Averages& averages,
                                      const std::vector<std::uint32_t>& order) {
  std::vector<SeenSides> sides(averages.means.size());
  for (std::size_t i = 0; i < placed.points.size(); ++i) {
    AddTo(sides[averages.mean_of[i]], placed.points[i], placed.toward[i]);
  }
  std::vector<SeenSides> ordered;
  ordered.reserve(sides.size());
  for (const std::uint32_t i : order) ordered.push_back(sides[i]);
  return ordered;
}

// In the order of a grid.
std::vector<Eigen::Vector3f> TowardBelow(const PlacedPoints& placed,
                                         const Averages& averages,
                                         const std::vector<std::uint32_t>& order) {
  constexpr float kMinSine = 0.05F;
  std::vector<Eigen::Vector3f> sums(averages.means.size(), Eigen::Vector3f::Zero());
  std::vector<bool> seen_from_above(sums.size(), false);
  for (std::size_t i = 0; i < placed.points.size(); ++i) {
    const std::uint32_t mean = averages.mean_of[i];
    if (placed.toward[i].z() > -kMinSine) seen_from_above[mean] = true;
    sums[mean] += placed.toward[i];
  }
  std::vector<Eigen::Vector3f> ordered;
  ordered.reserve(sums.size());
  for (const std::uint32_t i : order) {
    ordered.push_back(seen_from_above[i] ? Eigen::Vector3f::Zero() : sums[i]);
  }
  return ordered;
}

}  // namespace

absl::Status TargetOptions::Validate() const {
  OptionChecks checks("target options");
  checks.InRange("thinning_m", thinning_m, 0.0, 10.0);
  checks.InRange("radius_m", radius_m, 1.0, 1e4);
  checks.InRange("|centre|", centre.norm(), 0.0, 1e8);
  return checks.status();
}

RegistrationTarget::RegistrationTarget(std::span<const PlacedScan> scans,
                                       const TargetOptions& options)
    : origin_(options.centre) {
  if (options.from_one_place) {
    for (const PlacedScan& scan : scans) {
      sensors_.push_back(scan.T_target_scan * scan.features->sensor_origin() - origin_);
    }
  }
  const bool averaged = scans.size() > 1 && options.thinning_m > 0.0;
  for (int c = 0; c < kFeatureClasses; ++c) {
    const auto feature_class = static_cast<FeatureClass>(c);
    const bool sided =
        averaged && options.from_one_place && feature_class != FeatureClass::kNonTraversable;
    const PlacedPoints placed = PlacePoints(scans, feature_class, origin_, options.radius_m, sided);
    if (!averaged) {
      grids_[c] = std::make_shared<const ColumnGrid>(placed.points, kColumnSizeM);
      continue;
    }
    const Averages averages = AverageInCubes(placed.points, static_cast<float>(options.thinning_m));
    std::vector<std::uint32_t> order;
    grids_[c] =
        std::make_shared<const ColumnGrid>(averages.means, kColumnSizeM, sided ? &order : nullptr);
    if (sided && feature_class == FeatureClass::kVertical) {
      upright_sides_ = UprightSidesOf(placed, averages, order);
    } else if (sided) {
      toward_below_ = TowardBelow(placed, averages, order);
    }
  }
}

std::size_t RegistrationTarget::size() const {
  std::size_t size = 0;
  for (const auto& grid : grids_) size += grid->points().size();
  return size;
}

std::size_t RegistrationTarget::memory_bytes() const {
  std::size_t bytes = sizeof(*this) + upright_sides_.capacity() * sizeof(SeenSides) +
                      sensors_.capacity() * sizeof(Eigen::Vector3d) +
                      toward_below_.capacity() * sizeof(Eigen::Vector3f);
  for (const auto& grid : grids_) bytes += grid->memory_bytes();
  return bytes;
}

}  // namespace strata
