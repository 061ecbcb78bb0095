#include "core/completion/entities.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
#include <utility>

#include "core/cloud/point_tree.h"
#include "core/common/disjoint_sets.h"
#include "core/common/option_checks.h"
#include "core/common/status.h"
#include "core/completion/upright_box.h"

namespace strata {
namespace {

constexpr double kSpacings = 3.0;  // of the threshold
constexpr int kSpacingNeighbour = 4;
constexpr std::size_t kEveryNth = 4;  // voxel is measured
constexpr double kSpacingMarginM = 1.0;
constexpr std::size_t kLook = 4096;  // voxels between looks at the stop

// The voxels of one class in a square, about its middle.
struct ClassPoints {
  ClassPoints(const SquareVoxels& square, const std::vector<std::size_t>& indexes)
      : points(PointsOf(square, indexes)),
        view{points},
        tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(16)) {
    tree.buildIndex();
  }
  static std::vector<Eigen::Vector3f> PointsOf(const SquareVoxels& square,
                                               const std::vector<std::size_t>& indexes) {
    const Eigen::Vector2d middle = square.square().center();
    const Eigen::Vector3d origin(middle.x(), middle.y(), 0.0);
    std::vector<Eigen::Vector3f> points;
    points.reserve(indexes.size());
    for (const std::size_t i : indexes) {
      points.emplace_back((square.MeanOf(square.voxels()[i]) - origin).cast<float>());
    }
    return points;
  }
  const std::vector<Eigen::Vector3f> points;
  const PointsView view;
  PointTree tree;
};

using Neighbours = std::vector<std::pair<std::uint32_t, float>>;

// Where a voxel that counts is kept.
struct Kept {
  Eigen::Vector3f p;  // from the middle of its square
  std::uint32_t square = 0;
};

double RadiusOf(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  double radius = 0.0;
  for (const Eigen::Vector3d& p : points) radius = std::max(radius, (p - mean).norm());
  return radius;
}

bool ComesBefore(const FoundEntity& a, const FoundEntity& b) {
  const auto key = [](const FoundEntity& e) {
    return std::make_tuple(e.class_id,
                           std::numeric_limits<std::uint64_t>::max() - e.points,
                           e.box.centre.x(),
                           e.box.centre.y(),
                           e.box.centre.z());
  };
  return key(a) < key(b);
}

}  // namespace

absl::Status EntityOptions::Validate() const {
  OptionChecks checks("entities");
  checks.InRange("distance_m", distance_m, 0.0, kMostEntityDistanceM);
  checks.InRange("voxel_m", voxel_m, 0.01, 1.0);
  checks.InRange("min_points", static_cast<double>(min_points), 1.0, 1e12);
  return checks.status();
}

struct EntityFinder::State {
  // What one set of voxels has, told by its root as it was then.
  struct Sum {
    std::uint16_t class_id = 0;
    std::map<std::uint32_t, std::uint64_t> points;  // by scan
  };

  EntityOptions options;
  std::map<std::uint16_t, std::vector<float>> spacings;
  std::map<std::uint16_t, double> reaches;
  std::vector<Eigen::Vector3d> origins;  // of squares
  std::vector<Kept> kept;
  HashMap<VoxelKey, std::size_t> at_borders;  // index in `kept`
  DisjointSets sets;                          // of indexes in `kept`
  std::map<std::size_t, Sum> sums;            // by root

  double ReachOf(std::uint16_t class_id) const;
  bool IsAtBorder(const SquareVoxels& square, const Eigen::Vector3d& p) const;
  absl::Status GrowClass(const SquareVoxels& square,
                         std::uint16_t class_id,
                         const std::vector<std::size_t>& indexes,
                         const Stop& stop);
  void Count(const SquareVoxels& square,
             const std::vector<std::size_t>& indexes,
             const std::vector<std::size_t>& places);
  std::map<std::size_t, Sum> JoinedSums();
};

double EntityFinder::State::ReachOf(std::uint16_t class_id) const {
  const auto found = reaches.find(class_id);
  return found == reaches.end() ? kSpacings * options.voxel_m : found->second;
}

// Whether another square may have a voxel within reach.
bool EntityFinder::State::IsAtBorder(const SquareVoxels& square, const Eigen::Vector3d& p) const {
  const double margin = kMostEntityDistanceM + 2.0 * options.voxel_m;
  const Eigen::Array2d low = square.square().min().array() + margin;
  const Eigen::Array2d high = square.square().max().array() - margin;
  return !((p.head<2>().array() > low).all() && (p.head<2>().array() < high).all());
}

absl::Status EntityFinder::State::GrowClass(const SquareVoxels& square,
                                            std::uint16_t class_id,
                                            const std::vector<std::size_t>& indexes,
                                            const Stop& stop) {
  const ClassPoints own(square, indexes);
  const auto reach = static_cast<float>(ReachOf(class_id));
  // Of each voxel the index in `kept`; none of one of another square that comes later.
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> places(indexes.size(), kNone);
  const auto number = static_cast<std::uint32_t>(origins.size() - 1);
  for (std::size_t i = 0; i < indexes.size(); ++i) {
    const SquareVoxels::Voxel& voxel = square.voxels()[indexes[i]];
    if (!voxel.own) {
      const auto found = at_borders.find(voxel.key);
      if (found != at_borders.end()) places[i] = found->second;
      continue;
    }
    places[i] = kept.size();
    kept.push_back({own.points[i], number});
    if (IsAtBorder(square, square.MeanOf(voxel))) at_borders.emplace(voxel.key, places[i]);
  }
  Neighbours near;
  for (std::size_t i = 0; i < indexes.size(); ++i) {
    if (i % kLook == 0) STRATA_RETURN_IF_ERROR(stop.status());
    if (!square.voxels()[indexes[i]].own) continue;
    own.tree.radiusSearch(
        own.points[i].data(), reach * reach, near, nanoflann::SearchParams(32, 0.0F, false));
    for (const auto& [j, squared] : near) {
      if (places[j] != kNone) sets.Join(places[i], places[j]);
    }
  }
  Count(square, indexes, places);
  return absl::OkStatus();
}

void EntityFinder::State::Count(const SquareVoxels& square,
                                const std::vector<std::size_t>& indexes,
                                const std::vector<std::size_t>& places) {
  for (std::size_t i = 0; i < indexes.size(); ++i) {
    const SquareVoxels::Voxel& voxel = square.voxels()[indexes[i]];
    if (!voxel.own) continue;
    Sum& sum = sums[sets.Root(places[i])];
    sum.class_id = voxel.key.class_id;
    for (const SquareVoxels::Seen& seen : voxel.seen) sum.points[seen.scan] += seen.points;
  }
}

// Sets may have been joined since they were counted.
std::map<std::size_t, EntityFinder::State::Sum> EntityFinder::State::JoinedSums() {
  std::map<std::size_t, Sum> joined;
  for (const auto& [root, sum] : sums) {
    Sum& all = joined[sets.Root(root)];
    all.class_id = sum.class_id;
    for (const auto& [scan, points] : sum.points) all.points[scan] += points;
  }
  return joined;
}

EntityFinder::EntityFinder(const EntityOptions& options) : state_(std::make_unique<State>()) {
  state_->options = options;
}

EntityFinder::~EntityFinder() = default;

SquareVoxels EntityFinder::ForSpacing(const Eigen::AlignedBox2d& square) const {
  return {square, state_->options.voxel_m, kSpacingMarginM};
}

absl::Status EntityFinder::Measure(const SquareVoxels& voxels, const Stop& stop) {
  for (const auto& [class_id, indexes] : voxels.ByClass()) {
    STRATA_RETURN_IF_ERROR(stop.status());
    std::vector<float>& spacings = state_->spacings[class_id];
    if (state_->options.distance_m > 0.0) continue;
    const ClassPoints own(voxels, indexes);
    std::size_t count = 0;
    for (std::size_t i = 0; i < indexes.size(); ++i) {
      if (!voxels.voxels()[indexes[i]].own || count++ % kEveryNth != 0) continue;
      std::uint32_t at[kSpacingNeighbour + 1];
      float squared[kSpacingNeighbour + 1];
      const std::size_t found =
          own.tree.knnSearch(own.points[i].data(), kSpacingNeighbour + 1, at, squared);
      if (found == kSpacingNeighbour + 1) spacings.push_back(std::sqrt(squared[kSpacingNeighbour]));
    }
  }
  return absl::OkStatus();
}

const std::map<std::uint16_t, double>& EntityFinder::Reaches() {
  const EntityOptions& options = state_->options;
  for (auto& [class_id, spacings] : state_->spacings) {
    double reach = options.distance_m > 0.0 ? options.distance_m : kSpacings * options.voxel_m;
    if (!spacings.empty()) {
      const auto middle = spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 2);
      std::nth_element(spacings.begin(), middle, spacings.end());
      reach = std::min(kSpacings * static_cast<double>(*middle), kMostEntityDistanceM);
    }
    state_->reaches[class_id] = reach;
  }
  return state_->reaches;
}

SquareVoxels EntityFinder::ForGrowing(const Eigen::AlignedBox2d& square) const {
  double farthest = 0.0;
  for (const auto& [class_id, reach] : state_->reaches) farthest = std::max(farthest, reach);
  return {square, state_->options.voxel_m, farthest + 2.0 * state_->options.voxel_m};
}

absl::Status EntityFinder::Grow(const SquareVoxels& voxels, const Stop& stop) {
  const Eigen::Vector2d middle = voxels.square().center();
  state_->origins.emplace_back(middle.x(), middle.y(), 0.0);
  for (const auto& [class_id, indexes] : voxels.ByClass()) {
    STRATA_RETURN_IF_ERROR(state_->GrowClass(voxels, class_id, indexes, stop));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<FoundEntity>> EntityFinder::Finish(const Stop& stop) {
  State& state = *state_;
  std::vector<FoundEntity> entities;
  std::map<std::size_t, std::size_t> index_of_root;
  for (const auto& [root, sum] : state.JoinedSums()) {
    FoundEntity entity;
    entity.class_id = sum.class_id;
    for (const auto& [scan, points] : sum.points) {
      entity.scans.push_back({scan, points});
      entity.points += points;
    }
    if (entity.points < state.options.min_points) continue;
    index_of_root[root] = entities.size();
    entities.push_back(std::move(entity));
  }
  for (std::size_t i = 0; i < state.kept.size(); ++i) {
    const auto found = index_of_root.find(state.sets.Root(i));
    if (found == index_of_root.end()) continue;
    const Kept& kept = state.kept[i];
    entities[found->second].voxels.emplace_back(state.origins[kept.square] + kept.p.cast<double>());
  }
  for (FoundEntity& entity : entities) {
    STRATA_RETURN_IF_ERROR(stop.status());
    entity.box = UprightBoxOf(entity.voxels);
    entity.radius_m = RadiusOf(entity.voxels);
  }
  std::sort(entities.begin(), entities.end(), ComesBefore);
  return entities;
}

}  // namespace strata
