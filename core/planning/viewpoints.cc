#include "core/planning/viewpoints.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/geometry/pose.h"
#include "core/mesh/voxel_blocks.h"
#include "core/occupancy/expected_view.h"
#include "core/planning/endpoint.h"
#include "core/planning/move_cost.h"
#include "core/planning/open_ground.h"
#include "core/planning/search.h"
#include "core/planning/search_workspace.h"

namespace strata {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr int kHeadings = 8;
// Regions that nobody asked for are of whole multiples, so that a robot that has moved a little
// finds its own again [m].
constexpr double kRegionStepM = 10.0;
constexpr double kRegionStepUpM = 1.0;
constexpr double kBelowM = 1.0;
// What a glance may say too little [1, bits].
constexpr double kGlanceSlack = 1.5;
constexpr double kGlanceSlackBits = 500.0;
// So near to each other places see the same [m].
constexpr double kSameLookM = 0.5;
constexpr double kAboveM = 1.0;

struct Stand {
  PatchId patch = kNoPatchId;
  Vector3d place = Vector3d::Zero();
  double cost_m = 0.0;
  double gain_bits = std::numeric_limits<double>::infinity();  // at most, as last estimated
  int heading = 0;                                             // of that
  bool fresh = false;                                          // estimated since a view was taken
};

// Costs in a workspace in metres.
double MetresOf(const SearchSpace& space, std::uint32_t cost) {
  return cost * space.checks().cell_size_m / kCostPerCell;
}

std::uint32_t CostOf(const SearchSpace& space, double cost_m) {
  const double cost = cost_m / space.checks().cell_size_m * kCostPerCell;
  return static_cast<std::uint32_t>(std::min(cost, static_cast<double>(kAnyCost)));
}

// All that was reached within the budget, the cheapest first.
std::vector<Stand> ReachedPlaces(SearchSpace& space,
                                 SearchWorkspace& workspace,
                                 std::uint32_t budget) {
  std::vector<Stand> places;
  ForEachReached(space, workspace, budget, [&](PatchId patch, std::uint32_t cost) {
    Stand& stand = places.emplace_back();
    stand.patch = patch;
    stand.cost_m = MetresOf(space, cost);
  });
  for (Stand& stand : places) stand.place = space.Position(stand.patch);
  std::sort(places.begin(), places.end(), [](const Stand& a, const Stand& b) {
    return std::tuple(a.cost_m, a.place.x(), a.place.y(), a.place.z()) <
           std::tuple(b.cost_m, b.place.x(), b.place.y(), b.place.z());
  });
  return places;
}

// Leaves out those that are close to one before them.
std::vector<Stand> ThinnedOut(const std::vector<Stand>& places) {
  HashMap<BlockKey, std::vector<Vector3d>> kept;
  std::vector<Stand> stands;
  for (const Stand& stand : places) {
    const Eigen::Vector3i at = (stand.place / kStandSpacingM).array().floor().cast<int>();
    bool alone = true;
    for (int i = 0; i < 27 && alone; ++i) {
      const auto found =
          kept.find({at.x() + i % 3 - 1, at.y() + i / 3 % 3 - 1, at.z() + i / 9 - 1});
      if (found == kept.end()) continue;
      alone = std::none_of(found->second.begin(), found->second.end(), [&](const Vector3d& p) {
        return (p - stand.place).norm() < kStandSpacingM;
      });
    }
    if (!alone) continue;
    kept[{at.x(), at.y(), at.z()}].push_back(stand.place);
    stands.push_back(stand);
  }
  return stands;
}

// Around the sensor at all stands.
AlignedBox3d SensorsOf(const std::vector<Stand>& stands, const ExploreQuery& query) {
  AlignedBox3d box;
  for (const Stand& stand : stands) {
    box.extend(stand.place + query.sensor_height_m * Vector3d::UnitZ());
  }
  return box;
}

// What is looked at where nobody says which.
AlignedBox3d RegionAround(const std::vector<Stand>& stands, const ExploreQuery& query) {
  AlignedBox3d box;
  for (const Stand& stand : stands) box.extend(stand.place);
  const double across = query.sensor.max_range_m;
  const double above = std::max(query.profile.height_m, query.sensor_height_m) + kAboveM;
  const Eigen::Array3d step(kRegionStepM, kRegionStepM, kRegionStepUpM);
  const Eigen::Array3d low = box.min().array() - Eigen::Array3d(across, across, kBelowM);
  const Eigen::Array3d high = box.max().array() + Eigen::Array3d(across, across, above);
  return {((low / step).floor() * step).matrix(), ((high / step).ceil() * step).matrix()};
}

absl::Status CheckVoxels(const AlignedBox3d& region, double voxel_m) {
  const Vector3d sizes = region.sizes();
  const double voxels = (sizes / voxel_m).prod();
  if (voxels <= static_cast<double>(kMaxExploreVoxels)) return absl::OkStatus();
  const double fits_m = std::cbrt(sizes.prod() / static_cast<double>(kMaxExploreVoxels));
  return absl::InvalidArgumentError(
      absl::StrFormat("explore: %.0f × %.0f × %.0f m have %.0f million voxels of %g m, more than "
                      "%d million; take a "
                      "resolution of %g m or more, a smaller budget or a region",
                      sizes.x(),
                      sizes.y(),
                      sizes.z(),
                      voxels / 1e6,
                      voxel_m,
                      kMaxExploreVoxels / 1'000'000,
                      std::ceil(fits_m * 100.0 + 1e-6) / 100.0));
}

class ViewChooser {
 public:
  ViewChooser(SearchSpace& space,
              const ExploreQuery& query,
              const SeenSpace& seen,
              const AlignedBox3d& region,
              std::vector<Stand> stands,
              const std::vector<Vector3d>& open_ground,
              const Stop& stop)
      : space_(space),
        query_(query),
        views_(seen.voxels, query.sensor, region, kGroundWeight),
        stands_(std::move(stands)),
        level_m_(stands_.empty() ? 0.0 : stands_.front().place.z()),
        headings_(query.sensor.width_rad < 2.0 * std::numbers::pi - 1e-3 ? kHeadings : 1),
        looks_(seen.looks),
        stop_(stop) {
    for (const Vector3d& place : open_ground) views_.AddOpenGround(place);
  }

  absl::StatusOr<std::vector<ExploreView>> Choose() {
    std::vector<ExploreView> chosen;
    while (chosen.size() < static_cast<std::size_t>(query_.count)) {
      STRATA_ASSIGN_OR_RETURN(const std::size_t best, Best());
      if (best == stands_.size()) break;
      Stand& stand = stands_[best];
      ExploreView view;
      view.place = stand.place;
      view.T_map_sensor = PoseAt(stand, stand.heading);
      const ViewGain gain = views_.Follow(view.T_map_sensor);
      stand.gain_bits = gain.bits;
      if (UtilityOf(stand) < query_.min_bits) continue;
      view.gain_bits = gain.bits;
      view.volume_m3 = gain.volume_m3;
      view.cost_m = stand.cost_m;
      view.utility_bits = UtilityOf(stand);
      chosen.push_back(view);
      views_.Take();
      for (Stand& other : stands_) other.fresh = false;
      stand.gain_bits = 0.0;
      if (chosen.size() < static_cast<std::size_t>(query_.count)) {
        STRATA_RETURN_IF_ERROR(MoveTo(stand.patch));
      }
    }
    return chosen;
  }

 private:
  Pose PoseAt(const Stand& stand, int heading) const {
    const double yaw = 2.0 * std::numbers::pi * heading / kHeadings;
    return MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ())),
                    stand.place + query_.sensor_height_m * Vector3d::UnitZ());
  }
  double UtilityOf(const Stand& stand) const {
    return stand.gain_bits - query_.bits_per_m * stand.cost_m;
  }
  // Whether a scan was taken from there, more or less, and towards the same side. It has told what
  // such a look tells: where more is expected, something that nobody saw hides it.
  bool HasLooked(const Pose& T_map_sensor) const {
    return std::any_of(looks_.begin(), looks_.end(), [&](const Pose& look) {
      if ((look.translation() - T_map_sensor.translation()).norm() > kSameLookM) return false;
      const double turn = look.linear().col(0).dot(T_map_sensor.linear().col(0));
      return headings_ == 1 || turn >= std::cos(0.5 * query_.sensor.width_rad);
    });
  }
  // Gonzalez-Banos and Latombe, "Navigation Strategies for Exploring Indoor Environments", 2002.
  static double RankOf(const Stand& stand) {
    return stand.gain_bits * std::exp(-stand.cost_m / kNearM);
  }

  // Calls look(pose, heading) for the ways to look from the stand that were not tried yet.
  template <typename Look>
  void ForEachLook(const Stand& stand, const Look& look) const {
    for (int heading = 0; heading < headings_; ++heading) {
      const Pose T_map_sensor = PoseAt(stand, heading);
      if (!HasLooked(T_map_sensor)) look(T_map_sensor, heading);
    }
  }

  absl::Status Estimate(Stand& stand) {
    STRATA_RETURN_IF_ERROR(stop_.status());
    stand.fresh = true;
    stand.gain_bits = 0.0;
    ForEachLook(stand, [&](const Pose& T_map_sensor, int heading) {
      const double bits = views_.Estimate(T_map_sensor).bits;
      if (bits <= stand.gain_bits) return;
      stand.gain_bits = bits;
      stand.heading = heading;
    });
    return absl::OkStatus();
  }

  // A bound, so that few have to be estimated.
  absl::Status Glance(Stand& stand) {
    STRATA_RETURN_IF_ERROR(stop_.status());
    stand.gain_bits = 0.0;
    ForEachLook(stand, [&](const Pose& T_map_sensor, int /*heading*/) {
      const double bits = kGlanceSlack * views_.Glance(T_map_sensor).bits + kGlanceSlackBits;
      stand.gain_bits = std::max(stand.gain_bits, bits);
    });
    return absl::OkStatus();
  }

  // The best of [begin, end) of order_ that is worth enough, else stands_.size(). What a view is
  // worth only falls as others are taken: what is worth less than the best was before is not looked
  // at again.
  absl::StatusOr<std::size_t> BestOf(std::size_t begin, std::size_t end) {
    std::vector<std::size_t> by_bound(order_.begin() + static_cast<std::ptrdiff_t>(begin),
                                      order_.begin() + static_cast<std::ptrdiff_t>(end));
    std::stable_sort(by_bound.begin(), by_bound.end(), [&](std::size_t a, std::size_t b) {
      return RankOf(stands_[a]) > RankOf(stands_[b]);
    });
    std::size_t best = stands_.size();
    double most = 0.0;
    for (const std::size_t i : by_bound) {
      if (best != stands_.size() && RankOf(stands_[i]) <= most) break;
      if (!stands_[i].fresh) STRATA_RETURN_IF_ERROR(Estimate(stands_[i]));
      if (UtilityOf(stands_[i]) < query_.min_bits) continue;
      const double rank = RankOf(stands_[i]);
      if (best != stands_.size() && rank <= most) continue;
      most = rank;
      best = i;
    }
    return best;
  }

  absl::StatusOr<std::size_t> Best() {
    STRATA_ASSIGN_OR_RETURN(const std::size_t best, BestOfLevel(true));
    return best != stands_.size() ? best : BestOfLevel(false);
  }

  // On the robot's own level, or on the others.
  absl::StatusOr<std::size_t> BestOfLevel(bool own) {
    order_.clear();
    for (std::size_t i = 0; i < stands_.size(); ++i) {
      Stand& stand = stands_[i];
      if ((std::abs(stand.place.z() - level_m_) <= kLevelM) != own) continue;
      if (!std::isfinite(stand.cost_m)) continue;
      if (!std::isfinite(stand.gain_bits)) STRATA_RETURN_IF_ERROR(Glance(stand));
      if (UtilityOf(stand) >= query_.min_bits) order_.push_back(i);
    }
    std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return stands_[a].cost_m < stands_[b].cost_m;
    });
    const std::size_t horizon =
        query_.horizon == 0 ? order_.size() : static_cast<std::size_t>(query_.horizon);
    for (std::size_t begin = 0; begin < order_.size(); begin += horizon) {
      STRATA_ASSIGN_OR_RETURN(const std::size_t best,
                              BestOf(begin, std::min(order_.size(), begin + horizon)));
      if (best != stands_.size()) return best;
    }
    return stands_.size();
  }

  // What the others cost from there.
  absl::Status MoveTo(PatchId patch) {
    level_m_ = space_.Height(patch);
    SearchWorkspace workspace;
    STRATA_RETURN_IF_ERROR(
        ReachAll(space_, patch, workspace, stop_, CostOf(space_, 2.0 * query_.budget_m)).status());
    for (Stand& stand : stands_) {
      const int slot = space_.SlotOf(stand.patch);
      std::uint32_t cost = SearchWorkspace::Member::kUnreached;
      if (workspace.AtHand(slot)) {
        cost = workspace.member(slot).costs[stand.patch - space_.slots()[slot].base];
      }
      stand.cost_m = cost == SearchWorkspace::Member::kUnreached
                         ? std::numeric_limits<double>::infinity()
                         : MetresOf(space_, cost);
    }
    return absl::OkStatus();
  }

  SearchSpace& space_;
  const ExploreQuery& query_;
  ExpectedViews views_;
  std::vector<Stand> stands_;
  double level_m_;  // where the robot is then
  std::vector<std::size_t> order_;
  const int headings_;
  const std::vector<Pose>& looks_;
  const Stop& stop_;
};

std::string MessageOf(const ExploreResult& result, const ExploreQuery& query) {
  const double known = result.region_m3 > 0.0 ? result.known_m3 / result.region_m3 : 0.0;
  std::string message =
      result.views.empty()
          ? absl::StrFormat("explored: none of %d places within %g m is worth %g bits",
                            result.stands,
                            query.budget_m,
                            query.min_bits)
          : absl::StrFormat("%d of %d places", result.views.size(), result.stands);
  absl::StrAppend(&message, absl::StrFormat("; %.1f %% of the region is known", 100.0 * known));
  if (result.scans_left_out > 0) {
    absl::StrAppend(&message,
                    "; ",
                    result.scans_left_out,
                    " scans left out: their points were dropped or are damaged");
  }
  return message;
}

}  // namespace

absl::StatusOr<ExploreResult> ChooseViews(SearchSpace& space,
                                          const ExploreQuery& query,
                                          SpaceOf space_of,
                                          const Stop& stop) {
  STRATA_RETURN_IF_ERROR(ValidateExploreQuery(query));
  STRATA_RETURN_IF_ERROR(ValidateEndpoint("from", query.from, space.checks().cell_size_m));
  STRATA_ASSIGN_OR_RETURN(const EndpointMatch from, MatchEndpoint(space, query.from));
  ExploreResult result;
  if (from.patch == kNoPatchId) {
    result.reason = ExploreReason::kStartNotOnSurface;
    result.message = absl::StrCat("start: ", from.message);
    result.nearest = from.nearest;
    return result;
  }
  SearchWorkspace workspace;
  const std::uint32_t budget = CostOf(space, query.budget_m);
  STRATA_RETURN_IF_ERROR(ReachAll(space, from.patch, workspace, stop, budget).status());
  const std::vector<Stand> places = ReachedPlaces(space, workspace, budget);
  std::vector<Stand> stands = ThinnedOut(places);
  STRATA_RETURN_IF_ERROR(space.status());
  result.stands = stands.size();
  result.region = query.region.value_or(RegionAround(stands, query));
  result.region_m3 = result.region.volume();
  AlignedBox3d around = result.region;
  if (query.region.has_value()) {
    // What may hide something lies between sensors and the region.
    const Vector3d range = Vector3d::Constant(query.sensor.max_range_m);
    const AlignedBox3d sensors = SensorsOf(stands, query);
    const AlignedBox3d in_sight(sensors.min() - range, sensors.max() + range);
    around = sensors.merged(around)
                 .intersection({around.min() - range, around.max() + range})
                 .intersection(in_sight);
    if (!in_sight.intersects(result.region)) around.setEmpty();
  }
  if (around.isEmpty() || around.volume() <= 0.0) {
    result.reason = ExploreReason::kExplored;
    result.message = absl::StrFormat(
        "the region is out of sight of all %d places within %g m; take a larger "
        "budget or another region",
        stands.size(),
        query.budget_m);
    return result;
  }
  STRATA_RETURN_IF_ERROR(CheckVoxels(around, query.resolution_m));
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<const SeenSpace> seen,
                          space_of(around, query.resolution_m));
  std::vector<PatchId> reached;
  reached.reserve(places.size());
  for (const Stand& place : places) reached.push_back(place.patch);
  const std::vector<Vector3d> open = OpenGround(space, reached, *seen, query.sensor);
  ViewChooser chooser(space, query, *seen, result.region, std::move(stands), open, stop);
  STRATA_ASSIGN_OR_RETURN(result.views, chooser.Choose());
  STRATA_RETURN_IF_ERROR(space.status());
  result.reason = result.views.empty() ? ExploreReason::kExplored : ExploreReason::kViews;
  result.known_m3 =
      static_cast<double>(seen->voxels.CountKnown(result.region)) * std::pow(query.resolution_m, 3);
  result.scans = seen->looks.size();
  result.scans_left_out = seen->left_out;
  result.message = MessageOf(result, query);
  if (!from.message.empty()) absl::StrAppend(&result.message, "; start ", from.message);
  return result;
}

}  // namespace strata
