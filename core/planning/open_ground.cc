#include "core/planning/open_ground.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/cloud/field_of_view.h"
#include "core/common/hash_map.h"
#include "core/geometry/pose.h"
#include "core/mesh/voxel_blocks.h"
#include "core/mls/tile_key.h"
#include "core/occupancy/occupancy_voxels.h"
#include "core/occupancy/voxel_walk.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/search_space.h"
#include "core/planning/viewpoints.h"

namespace strata {
namespace {

using Eigen::Vector3d;

class GroundFlood {
 public:
  GroundFlood(SearchSpace& space, const SeenSpace& seen, const FieldOfView& sensor)
      : space_(space),
        checks_(space.checks()),
        looks_(seen.looks),
        reader_(seen.voxels),
        voxel_m_(seen.voxels.voxel_m()),
        sensor_(sensor) {}

  std::vector<Vector3d> Run(const std::vector<PatchId>& reached) {
    for (const PatchId patch : reached) Mark(patch);
    beyond_.resize(marked_.size());
    for (const PatchId patch : reached) LookAround(patch);
    for (std::size_t i = 0; i < queue_.size(); ++i) LookAround(queue_[i]);
    open_.erase(std::remove_if(open_.begin(),
                               open_.end(),
                               [this](const Vector3d& place) {
                                 return std::any_of(
                                     looks_.begin(), looks_.end(), [&](const Pose& look) {
                                       return Showed(look, place);
                                     });
                               }),
                open_.end());
    const std::size_t holes = open_.size();
    for (std::size_t i = 0; i < holes; ++i) AddAround(open_[i]);
    return open_;
  }

 private:
  // What nothing but a hole keeps the robot from, as far as anybody knows: patches that were not
  // reached, of which it would cover the hole.
  void AddAround(Vector3d hole) {
    const auto cell_of = [this](double x) {
      return static_cast<std::int32_t>(std::floor(x / checks_.cell_size_m));
    };
    const CellIndex middle = {cell_of(hole.x()), cell_of(hole.y())};
    for (const DiscCell& at : checks_.disc) {
      if (at.distance_m > checks_.footprint_m) break;
      for (const PatchId patch : space_.FindCell({middle.x + at.dx, middle.y + at.dy})) {
        if (patch >= beyond_.size() || !beyond_[patch]) continue;
        if (std::abs(space_.Height(patch) - hole.z()) > at.level_m) continue;
        beyond_[patch] = false;
        open_.push_back(space_.Position(patch));
      }
    }
  }

  // True the first time.
  bool Mark(PatchId patch) {
    if (patch >= marked_.size()) marked_.resize(space_.end());
    if (marked_[patch]) return false;
    marked_[patch] = true;
    return true;
  }

  void LookAround(PatchId patch) {
    const CellIndex from = space_.CellOfPatch(patch);
    const float z = space_.Height(patch);
    for (int k = 0; k < 8; ++k) {
      if (space_.HasMove(patch, k)) continue;
      CellIndex cell = from;
      for (int n = 0; n <= checks_.GapCells(k); ++n) {
        cell = {cell.x + kStepX[k], cell.y + kStepY[k]};
        if (!LookThrough(cell, z)) break;
      }
    }
  }

  // Whether it is open ground of level z.
  bool LookThrough(CellIndex cell, float z) {
    const Vector3d at(
        (cell.x + 0.5) * checks_.cell_size_m, (cell.y + 0.5) * checks_.cell_size_m, z);
    if (!IsFree(at, 1.5)) return false;  // no room, as far as anybody knows
    PatchId next = kNoPatchId;
    float nearest = checks_.step_m;
    for (const PatchId patch : space_.FindCell(cell)) {
      const float rise = space_.Height(patch) - z;
      if (rise > checks_.step_m && rise < checks_.height_m) return false;
      if (std::abs(rise) > nearest) continue;
      nearest = std::abs(rise);
      next = patch;
    }
    if (next != kNoPatchId) {
      if (Mark(next)) {
        queue_.push_back(next);
        if (next >= beyond_.size()) beyond_.resize(space_.end());
        beyond_[next] = true;
      }
      return false;
    }
    if (IsFree(at, 0.5) && IsFree(at, -0.5)) return false;  // a drop
    const auto level = static_cast<std::int32_t>(std::lround(z / checks_.height_m));
    if (known_.insert({cell.x, cell.y, level}).second) open_.push_back(at);
    return true;
  }

  // Whether a look from there had a beam for each cell around a place, and the way to it was free.
  bool Showed(const Pose& T_map_sensor, const Vector3d& place) {
    const Vector3d from = T_map_sensor.translation();
    const Vector3d ray = place - from;
    const double squared = ray.squaredNorm();
    const double rows_rad = (sensor_.up_rad + sensor_.down_rad) / sensor_.rows;
    if (-ray.z() * checks_.cell_size_m < rows_rad * squared) return false;
    const Vector3d in_sensor = T_map_sensor.linear().transpose() * ray;
    const double elevation = std::atan2(in_sensor.z(), in_sensor.head<2>().norm());
    if (elevation < -sensor_.down_rad || elevation > sensor_.up_rad) return false;
    if (std::abs(std::atan2(in_sensor.y(), in_sensor.x())) > 0.5 * sensor_.width_rad) return false;
    const double nearly = 1.0 - 2.0 * voxel_m_ / std::sqrt(squared);
    bool is_free = true;
    WalkVoxels(from / voxel_m_,
               place / voxel_m_,
               VoxelOf(from / voxel_m_),
               [&](const Eigen::Vector3i& at, double passed) {
                 const std::int16_t odds = reader_.Odds(at);
                 is_free = odds != OccupancyVoxels::kUnknownOdds && odds <= 0;
                 if (passed < nearly) return is_free;
                 is_free = true;
                 return false;
               });
    return is_free;
  }

  // Whether the voxel so many voxels above a place is known to be.
  bool IsFree(const Vector3d& place, double above) {
    const std::int16_t odds = reader_.Odds(VoxelOf(place / voxel_m_ + above * Vector3d::UnitZ()));
    return odds != OccupancyVoxels::kUnknownOdds && odds <= 0;
  }

  SearchSpace& space_;
  const ProfileChecks& checks_;
  const std::vector<Pose>& looks_;
  OccupancyReader reader_;
  const double voxel_m_;
  const FieldOfView& sensor_;
  std::vector<bool> marked_;    // by patch: reached, or in queue_
  std::vector<PatchId> queue_;  // of what ground goes on to
  std::vector<bool> beyond_;    // by patch: of queue_, and not in open_
  HashSet<BlockKey> known_;     // open_ by cell and level
  std::vector<Vector3d> open_;
};

}  // namespace

std::vector<Vector3d> OpenGround(SearchSpace& space,
                                 const std::vector<PatchId>& reached,
                                 const SeenSpace& seen,
                                 const FieldOfView& sensor) {
  return GroundFlood(space, seen, sensor).Run(reached);
}

}  // namespace strata
