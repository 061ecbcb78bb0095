// How much a look from somewhere would tell (thesis 4.4.2).
#ifndef STRATA_CORE_OCCUPANCY_EXPECTED_VIEW_H_
#define STRATA_CORE_OCCUPANCY_EXPECTED_VIEW_H_

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/field_of_view.h"
#include "core/geometry/pose.h"
#include "core/mesh/voxel_blocks.h"
#include "core/occupancy/occupancy_voxels.h"
#include "core/occupancy/voxel_walk.h"

namespace strata {

struct ViewGain {
  double bits = 0.0;
  double volume_m3 = 0.0;  // of voxels that are known only then
};

// Expected information gain of views of a grid (eq. 4.13) with the most likely measurement of each
// beam: it ends in the first voxel that is occupied with more than 0.5, at the sensor's range, or
// where the grid's region ends. Unlike eq. 4.13 a voxel counts once a view, however many beams
// cross it, and the model is the grid's. Unknown space hides nothing: real views gain less, the
// order of places is what counts. One thread at a time; many may look at one grid.
class ExpectedViews {
 public:
  static constexpr int kMostEstimateBeams = 2000;
  static constexpr int kMostGlanceBeams = 250;

  // `grid` must outlive it; only what is in `region` counts, an unknown voxel right below a free
  // one `ground_weight` times: ground is one layer of voxels, the air over it many. REQUIRES: a
  // valid sensor.
  ExpectedViews(const OccupancyVoxels& grid,
                const FieldOfView& sensor,
                const Eigen::AlignedBox3d& region = OccupancyVoxelsOptions().region,
                double ground_weight = 1.0);

  // A surface there was seen too sparsely: to one of the beams that end in its voxel from above it
  // is one more voxel of unknown ground, to no beam more than one.
  void AddOpenGround(const Eigen::Vector3d& place);

  // From kMostEstimateBeams at most; the voxels of each stand for those that the beams around it
  // would cross.
  ViewGain Estimate(const Pose& T_map_sensor);
  // The same from kMostGlanceBeams: what to estimate first.
  ViewGain Glance(const Pose& T_map_sensor);
  // From all beams.
  ViewGain Follow(const Pose& T_map_sensor);
  // What the view before crossed is thought to be known from then on and gains nothing any more.
  void Take();

 private:
  static constexpr std::uint16_t kTaken = 0xFFFF;
  struct Mark {
    std::uint16_t view = 0;  // that looked last, or kTaken
    std::uint8_t open = 0;   // places with open ground
    std::uint8_t ended = 0;  // beams of the view that looked last, where there are such
  };
  struct Beams {
    std::vector<Eigen::Vector3d> directions;
    double each = 1.0;         // of the sensor's beams that one stands for
    double solid_angle = 0.0;  // of one, over the cosine of its elevation
  };

  void BeginView();
  bool IsUnderFree(const Eigen::Vector3i& at);
  bool Passes(const Eigen::Vector3i& at,
              const Eigen::Vector3d& from,
              const Eigen::Vector3d& along,
              double passed) const;
  ViewGain Look(const Pose& T_map_sensor, const Beams& beams);
  double WeightAt(const Beams& beams,
                  const Eigen::Vector3d& direction,
                  double voxels_per_length,
                  double range_m) const;

  const OccupancyVoxels& grid_;
  OccupancyReader reader_;
  const VoxelBox counted_;
  const double max_range_m_;
  const double ground_weight_;
  Beams all_, some_, few_;
  std::vector<double> gain_of_hit_, gain_of_miss_;  // by odds
  std::int16_t least_odds_ = 0;
  VoxelBlocks<Mark> marks_;
  std::uint16_t view_ = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_OCCUPANCY_EXPECTED_VIEW_H_
