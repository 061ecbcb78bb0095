#include "core/posegraph/alignment/shared_surfaces.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/posegraph/alignment/plane_terms.h"

namespace strata {
namespace {

// Poses may be so many times as far off as the search takes them to be: its gates are of 3 σ.
constexpr double kAllowed = 3.0;
// Poses that settle move by so much less from round to round.
constexpr double kFalling = 0.8;

}  // namespace

absl::Status SharedSurfaces::Find(const std::vector<Pose>& T_map_scan, ForEach for_each) {
  if (!options_.planes || Hold()) return absl::OkStatus();
  std::vector<std::shared_ptr<const ScanPlanes>> held(T_map_scan.size());
  STRATA_RETURN_IF_ERROR(for_each(held.size(), [&](std::size_t k) -> absl::Status {
    absl::StatusOr<std::shared_ptr<const ScanPlanes>> planes = source_.Planes(k);
    if (absl::IsDataLoss(planes.status())) {
      held[k] = std::make_shared<const ScanPlanes>();
      return absl::OkStatus();
    }
    STRATA_RETURN_IF_ERROR(planes.status());
    held[k] = *std::move(planes);
    return absl::OkStatus();
  }));
  std::vector<PosedPlanes> posed;
  for (std::size_t k = 0; k < held.size(); ++k) {
    posed.push_back({held[k].get(), T_map_scan[k], source_.SensorOrigin(k)});
  }
  gates_ = GatesOfNow();
  stays_ = false;
  planes_ = FindSharedPlanes(posed, gates_);
  if (options_.directions) directions_ = FindSharedDirections(posed, gates_);
  std::erase_if(planes_, [&](const SharedPlane& plane) {
    return std::ranges::any_of(problem_.excluded_planes, [&](const ExcludedPlane& excluded) {
      return IsExcluded(plane, excluded, T_map_scan);
    });
  });
  return absl::OkStatus();
}

void SharedSurfaces::AddTo(PoseGraphProblem& graph) const {
  graph.planes.clear();
  graph.directions.clear();
  for (const SharedPlane& plane : planes_) {
    graph.planes.push_back(TermOf(plane, graph.T_map_scan));
  }
  for (const SharedDirection& direction : directions_) {
    graph.directions.push_back(TermOf(direction, graph.T_map_scan));
  }
}

bool SharedSurfaces::Split(const std::vector<std::size_t>& parts) {
  const bool is_split = std::ranges::any_of(planes_, [&parts](const SharedPlane& plane) {
    return std::ranges::any_of(plane.views, [&](const SharedPlane::View& view) {
      return parts[view.scan] != parts[plane.views[0].scan];
    });
  });
  if (is_split) planes_ = SplitByPart(planes_, parts);
  return is_split;
}

void SharedSurfaces::Keep(const std::vector<Plane>& planes) {
  for (std::size_t p = 0; p < planes_.size(); ++p) planes_[p].plane = planes[p];
}

void SharedSurfaces::Moved(double max_shift_m, double max_turn_rad) {
  const Motion now{max_shift_m, max_turn_rad};
  const bool falls = !last_.has_value() || now.shift_m <= kFalling * last_->shift_m;
  // Only of the finest search: a wide one takes for planes what a narrower one does not.
  const bool is_finest = gates_.pose_sigma_m <= SharedPlaneOptions().pose_sigma_m &&
                         gates_.pose_sigma_rad <= SharedPlaneOptions().pose_sigma_rad;
  stays_ = IsWithin(now, 1.0) || (is_finest && IsWithin(now, kAllowed) && (stays_ || !falls));
  last_ = now;
}

bool SharedSurfaces::IsWithin(const Motion& motion, double sigmas) const {
  return motion.shift_m <= sigmas * gates_.pose_sigma_m &&
         motion.turn_rad <= sigmas * gates_.pose_sigma_rad;
}

// Planes found anew at poses that differ by less than the search allows for are others by chance
// alone: poses would follow them for ever. Where the search allows for much, as rough poses need,
// what it finds is sorted out once poses have settled in it.
bool SharedSurfaces::Hold() const { return stays_ && !MayNarrow(); }

bool SharedSurfaces::MayNarrow() const {
  if (!options_.planes || !last_.has_value()) return false;
  const SharedPlaneOptions narrower = GatesOfNow();
  return narrower.pose_sigma_m < gates_.pose_sigma_m / 2.0 ||
         narrower.pose_sigma_rad < gates_.pose_sigma_rad / 2.0;
}

// Poses are as far off as they still move.
SharedPlaneOptions SharedSurfaces::GatesOfNow() const {
  SharedPlaneOptions gates = options_.shared_planes;
  if (!last_.has_value()) return gates;
  const SharedPlaneOptions finest;
  gates.pose_sigma_m = std::min(gates.pose_sigma_m, std::max(finest.pose_sigma_m, last_->shift_m));
  gates.pose_sigma_rad =
      std::min(gates.pose_sigma_rad, std::max(finest.pose_sigma_rad, last_->turn_rad));
  return gates;
}

}  // namespace strata
