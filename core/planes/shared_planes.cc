#include "core/planes/shared_planes.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>

#include "core/common/option_checks.h"
#include "core/planes/edge_planes.h"
#include "core/planes/moments.h"
#include "core/planes/patch_association.h"

namespace strata {
namespace {

// Whether these edges are creases and borders of a plane of patches that one of their scans sees:
// for it they say nothing new. Scans that see the border alone get no view of the plane by it: the
// last beam that meets a surface is up to a beam's spacing inside of its border, always to the same
// side, and an upper storey whose rim was seen from below was pulled down by 0.07 m.
bool IsBorderOf(const SharedPlane& plane,
                const SharedPlane& edges,
                std::span<const PosedPlanes> scans,
                double corridor_m) {
  const auto has_view = [&plane](std::size_t scan) {
    return std::any_of(plane.views.begin(), plane.views.end(), [scan](const auto& view) {
      return view.scan == scan;
    });
  };
  Eigen::Matrix4d all = Eigen::Matrix4d::Zero();
  bool seen = false;
  for (const SharedPlane::View& view : edges.views) {
    all += Moved(scans[view.scan].T_map_scan, view.moments);
    seen = seen || has_view(view.scan);
  }
  return seen && RmsDistance(all, plane.plane) <= corridor_m;
}

void Append(std::vector<SharedPlane> found, std::vector<SharedPlane>& planes) {
  std::stable_sort(found.begin(), found.end(), [](const SharedPlane& a, const SharedPlane& b) {
    return a.support_value > b.support_value;
  });
  for (SharedPlane& plane : found) planes.push_back(std::move(plane));
}

}  // namespace

absl::Status SharedPlaneOptions::Validate() const {
  OptionChecks checks("shared planes");
  checks.InRange("pose_sigma_m", pose_sigma_m, 0.0, 10.0);
  checks.InRange("pose_sigma_rad", pose_sigma_rad, 0.0, 0.3);
  checks.InRange("min_overlap", min_overlap, 0.0, 1.0);
  checks.InRange("max_extent_m", max_extent_m, 1.0, 1000.0);
  checks.InRange("sigma_floor_m", sigma_floor_m, 1e-4, 1.0);
  checks.InRange("independent_area_m2", independent_area_m2, 1e-4, 100.0);
  checks.InRange("independent_length_m", independent_length_m, 1e-3, 100.0);
  checks.InRange("max_measurements", max_measurements, 1.0, 1e6);
  checks.InRange("corridor_m", corridor_m, 0.001, 1.0);
  checks.InRange("min_edge_support_m", min_edge_support_m, 0.1, 1e4);
  checks.InRange("hypotheses", hypotheses, 0, 1e6);
  return checks.status();
}

std::vector<SharedPlane> FindSharedPlanes(std::span<const PosedPlanes> scans,
                                          const SharedPlaneOptions& options) {
  std::vector<SharedPlane> planes;
  Append(FindPatchPlanes(scans, options), planes);
  std::vector<SharedPlane> of_edges = FindEdgePlanes(scans, options);
  std::erase_if(of_edges, [&](const SharedPlane& edges) {
    return std::any_of(planes.begin(), planes.end(), [&](const SharedPlane& plane) {
      return IsBorderOf(plane, edges, scans, options.corridor_m);
    });
  });
  Append(std::move(of_edges), planes);
  return planes;
}

}  // namespace strata
