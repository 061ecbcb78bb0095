// Which points of scans are of things that have gone: later scans looked through the places where
// they were. What was merely not looked at again stays.
//
// Evidence is kept for stretches of height of the cells that were ever hit, since a person's cell
// also holds the ground that she stood on: the lowest thickness of a patch is a surface, above it
// come slices of 0.2 m. A ray looks through a surface where it crosses it and ends well beyond, and
// through a slice where it passes inside of it and goes on. Rays that graze the ground, end near
// it, or pass beside something of which the same scan hits any part are evidence of nothing.
//
// Scans are taken newest first. A stretch that has been looked through by enough scans says of
// older points in it that they are of something gone; as soon as a scan has points in it that stay,
// it was there, and whoever saw it before did as well. So the answer is a pure function of the
// scans, their poses and their order. (Compare the free cells of occupancy grids, thesis 6.2.1.)
#ifndef STRATA_CORE_MLS_SEE_THROUGH_H_
#define STRATA_CORE_MLS_SEE_THROUGH_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/mls/mls_map.h"
#include "core/mls/tile_key.h"

namespace strata {

struct SeeThroughOptions {
  int scans = 3;             // that have to look through a place; in [1, 1000]
  int rays = 10;             // of them together; in [1, 100'000]
  double clearance_m = 0.3;  // that a ray has to end beyond what it looks through; in [0.05, 10]

  absl::Status Validate() const;
};

// Takes one scan after the other, newest first; for each BeginScan(), TakePoints() for all of its
// points, LookAlong() for all of its points, EndScan(). Not thread-safe. Some 60 bytes a stretch.
class SeeThrough {
 public:
  // `map`: what all the scans made together; points and rays outside of its tiles count for
  // nothing, and rays cost their way over the tiles only. REQUIRES: valid options.
  SeeThrough(const MlsMap& map, const SeeThroughOptions& options);

  // Where the sensor stood, map frame [m].
  void BeginScan(const Eigen::Vector3d& sensor);
  // Finite points of the scan, map frame [m]. Result: for each, how many later scans looked through
  // its place, where that is enough for it to be gone; else 0.
  std::vector<std::uint16_t> TakePoints(std::span<const Eigen::Vector3d> points);
  void LookAlong(std::span<const Eigen::Vector3d> points);
  void EndScan();

 private:
  // A patch, lowest first in its cell.
  struct Column {
    float bottom = 0.0F, top = 0.0F;
    float surface = 0.0F;  // height of the lowest stretch
    std::uint32_t first_stretch = 0;
    std::uint32_t stretches = 0;
  };
  struct Stretch {
    std::uint32_t hit_by = 0;  // the last scan with points in it
    std::uint32_t seen_by = 0;
    std::uint32_t rays_now = 0;  // of scan seen_by
    std::uint32_t rays = 0;
    std::uint16_t scans = 0;
    bool stays = false;
  };
  struct Tile {
    std::vector<std::uint32_t> begin;  // of the columns of each cell
  };
  // The way of a ray along x or y, in lengths of the ray.
  struct Axis {
    std::int32_t step = 0;
    double next = 0.0;   // where it comes to the next cell
    double every = 0.0;  // and then to each one after
  };
  // Where a stretch is.
  struct Place {
    CellIndex cell;
    std::uint32_t stretch = 0;
    float low = 0.0F, high = 0.0F;
  };

  // Cells of all tiles: [low, high).
  struct Window {
    CellIndex low{kMaxCellIndex, kMaxCellIndex};
    CellIndex high{-kMaxCellIndex, -kMaxCellIndex};
  };

  void AddTile(const MlsTile& tile);
  // The part of the ray to `end` that is over the window, in lengths of the ray; empty: first >
  // second.
  std::pair<double, double> OverWindow(const Eigen::Vector3d& ray) const;
  CellIndex CellAt(const Eigen::Vector3d& point) const;
  std::span<const Column> ColumnsOf(CellIndex cell) const;
  // The stretch that the point is in, or nullptr.
  Stretch* StretchAt(const Eigen::Vector3d& point);
  bool Gone(const Stretch& stretch) const;
  void LookAlong(const Eigen::Vector3d& end);
  // The ray is between heights z_in and z_out in the cell, and ends `rest_m` behind it at z_end.
  void LookInto(CellIndex cell, double z_in, double z_out, double rest_m, double z_end);
  void Look(CellIndex cell, const Column& column, std::uint32_t slice);
  // The current scan has points in the cells around, at that height.
  bool HitAround(const Place& place) const;
  float LowOf(const Column& column, std::uint32_t slice) const;
  float HighOf(const Column& column, std::uint32_t slice) const;

  const SeeThroughOptions options_;
  const double cell_size_m_;
  const float thickness_m_;
  HashMap<TileKey, Tile> tiles_;
  Window window_;
  std::vector<Column> columns_;
  std::vector<Stretch> stretches_;
  Eigen::Vector3d sensor_ = Eigen::Vector3d::Zero();
  std::uint32_t scan_ = 0;             // counts from 1
  std::vector<Place> looked_through_;  // by the current scan
};

}  // namespace strata

#endif  // STRATA_CORE_MLS_SEE_THROUGH_H_
