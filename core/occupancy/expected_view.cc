#include "core/occupancy/expected_view.h"

#include <algorithm>
#include <cmath>

#include "core/occupancy/information.h"
#include "core/occupancy/voxel_walk.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

// Every so many rows and columns; counted from the middle of the first such part.
struct Strides {
  int rows = 1;
  int columns = 1;
};

double RowSpacing(const FieldOfView& sensor) {
  return (sensor.up_rad + sensor.down_rad) / sensor.rows;
}

double ColumnSpacing(const FieldOfView& sensor) { return sensor.width_rad / sensor.columns; }

int CountOf(int all, int stride) { return (all + stride - 1) / stride; }

// Such that neighbouring beams are about as far apart in both directions.
Strides StridesFor(const FieldOfView& sensor, int most_beams) {
  Strides strides;
  while (CountOf(sensor.rows, strides.rows) * CountOf(sensor.columns, strides.columns) >
         most_beams) {
    const bool wide = strides.columns * ColumnSpacing(sensor) <= strides.rows * RowSpacing(sensor);
    const bool columns_left = strides.columns < sensor.columns;
    ++((wide && columns_left) || strides.rows >= sensor.rows ? strides.columns : strides.rows);
  }
  return strides;
}

std::vector<Vector3d> DirectionsOf(const FieldOfView& sensor, const Strides& strides) {
  std::vector<Vector3d> directions;
  for (int row = (strides.rows - 1) / 2; row < sensor.rows; row += strides.rows) {
    const double elevation = -sensor.down_rad + (row + 0.5) * RowSpacing(sensor);
    for (int column = (strides.columns - 1) / 2; column < sensor.columns;
         column += strides.columns) {
      const double azimuth = -sensor.width_rad / 2 + (column + 0.5) * ColumnSpacing(sensor);
      directions.emplace_back(std::cos(elevation) * std::cos(azimuth),
                              std::cos(elevation) * std::sin(azimuth),
                              std::sin(elevation));
    }
  }
  return directions;
}

}  // namespace

ExpectedViews::ExpectedViews(const OccupancyVoxels& grid,
                             const FieldOfView& sensor,
                             const Eigen::AlignedBox3d& region,
                             double ground_weight)
    : grid_(grid),
      reader_(grid),
      counted_(region, grid.voxel_m()),
      max_range_m_(sensor.max_range_m),
      ground_weight_(ground_weight) {
  const auto beams_of = [&sensor](int most) {
    const Strides strides = StridesFor(sensor, most);
    Beams beams;
    beams.directions = DirectionsOf(sensor, strides);
    beams.each = static_cast<double>(sensor.rows) * sensor.columns /
                 static_cast<double>(beams.directions.size());
    beams.solid_angle = strides.rows * RowSpacing(sensor) * strides.columns * ColumnSpacing(sensor);
    return beams;
  };
  all_ = beams_of(sensor.rows * sensor.columns);
  some_ = beams_of(kMostEstimateBeams);
  few_ = beams_of(kMostGlanceBeams);
  least_odds_ = grid.least_odds();
  for (std::int16_t odds = least_odds_; odds <= grid.most_odds(); ++odds) {
    const double before = OccupancyVoxels::ProbabilityOf(odds);
    const auto gain = [&](bool hit) {
      return InformationGainBits(before, OccupancyVoxels::ProbabilityOf(grid.After(odds, hit)));
    };
    gain_of_hit_.push_back(gain(true));
    gain_of_miss_.push_back(gain(false));
  }
}

void ExpectedViews::BeginView() {
  if (++view_ < kTaken) return;
  marks_.ForEach([](Mark& mark) {
    if (mark.view != kTaken) mark.view = 0;
  });
  view_ = 1;
}

// Of so many voxels beside this one the beams that this one stands for would cross some: those of
// the solid angle, as many in all as its volume has, of which a slanting beam crosses more.
double ExpectedViews::WeightAt(const Beams& beams,
                               const Vector3d& direction,
                               double voxels_per_length,
                               double range_m) const {
  const double across = range_m / grid_.voxel_m();
  const double cosine = std::hypot(direction.x(), direction.y());
  const double beside = beams.solid_angle * cosine * across * across / voxels_per_length;
  return std::max(1.0, std::min(beams.each, beside));
}

void ExpectedViews::AddOpenGround(const Vector3d& place) {
  // Beams end a little above or below it, maybe in another voxel.
  const Vector3i low = VoxelOf(place / grid_.voxel_m() - 0.25 * Vector3d::UnitZ());
  const Vector3i high = VoxelOf(place / grid_.voxel_m() + 0.25 * Vector3d::UnitZ());
  for (Vector3i at = low; at.z() <= high.z(); ++at.z()) {
    std::uint8_t& open = marks_.FindOrAdd(BlockOf(at))[NodeInBlock(at)].open;
    open = static_cast<std::uint8_t>(std::min(open + 1, 255));
  }
}

// Where the next surface below is, if nobody has seen it yet.
bool ExpectedViews::IsUnderFree(const Vector3i& at) {
  if (ground_weight_ == 1.0) return false;
  const std::int16_t above = reader_.Odds(at + Vector3i::UnitZ());
  return above != OccupancyVoxels::kUnknownOdds && above <= 0;
}

// Whether a beam goes through an occupied voxel that it enters after a share of its way.
bool ExpectedViews::Passes(const Vector3i& at,
                           const Vector3d& from,
                           const Vector3d& along,
                           double passed) const {
  double left = 1.0;
  for (int i = 0; i < 3; ++i) {
    if (along[i] == 0.0) continue;
    left = std::min(left, (at[i] + (along[i] > 0.0 ? 1 : 0) - from[i]) / along[i]);
  }
  return reader_.Passes(at, from.z() + passed * along.z(), from.z() + left * along.z());
}

ViewGain ExpectedViews::Look(const Pose& T_map_sensor, const Beams& beams) {
  BeginView();
  const double voxel_m = grid_.voxel_m();
  const Vector3d from = T_map_sensor.translation() / voxel_m;
  const Vector3i first = VoxelOf(from);
  ViewGain gain;
  for (const Vector3d& beam : beams.directions) {
    const Vector3d direction = T_map_sensor.linear() * beam;
    const Vector3d along = direction * (max_range_m_ / voxel_m);
    WalkVoxels(from, from + along, first, [&](const Vector3i& at, double passed) {
      if (!grid_.Inside(at)) return false;
      const double range_m = passed * max_range_m_;
      Mark& mark = marks_.FindOrAdd(BlockOf(at))[NodeInBlock(at)];
      const std::int16_t odds = reader_.Odds(at);
      const bool unknown = odds == OccupancyVoxels::kUnknownOdds;
      const bool open = mark.open > 0 && along.z() < 0.0;
      const bool hit = unknown ? open : odds > 0 && !Passes(at, from, along, passed);
      const bool counts = mark.view != kTaken && counted_.Contains(at);
      const auto weight = [&](double voxels_per_length) {
        return beams.each == 1.0 ? 1.0 : WeightAt(beams, beam, voxels_per_length, range_m);
      };
      if (counts && mark.view != view_) {
        const std::size_t number = (unknown ? 0 : odds) - least_odds_;
        const double worth = unknown && IsUnderFree(at) ? ground_weight_ : 1.0;
        const double voxels = weight(direction.lpNorm<1>());
        gain.bits += worth * voxels * (hit ? gain_of_hit_ : gain_of_miss_)[number];
        if (unknown) gain.volume_m3 += voxels * std::pow(voxel_m, 3);
      }
      if (mark.view != kTaken && mark.view != view_) {
        mark.view = view_;
        mark.ended = 0;
      }
      if (counts && hit && open && mark.ended < 255) {
        // Each beam shows one place more; they end in as many voxels as the level ground that they
        // cover has.
        const double left = weight(-direction.z()) * mark.open - mark.ended * beams.each;
        gain.bits +=
            ground_weight_ * std::clamp(left, 0.0, beams.each) * gain_of_hit_[-least_odds_];
        ++mark.ended;
      }
      return !hit;
    });
  }
  return gain;
}

ViewGain ExpectedViews::Estimate(const Pose& T_map_sensor) { return Look(T_map_sensor, some_); }

ViewGain ExpectedViews::Glance(const Pose& T_map_sensor) { return Look(T_map_sensor, few_); }

ViewGain ExpectedViews::Follow(const Pose& T_map_sensor) { return Look(T_map_sensor, all_); }

void ExpectedViews::Take() {
  marks_.ForEach([this](Mark& mark) {
    if (mark.view == view_) mark.view = kTaken;
  });
}

}  // namespace strata
