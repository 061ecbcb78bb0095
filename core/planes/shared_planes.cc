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

// True if the edges lie in a plane of patches that half of their scans see: creases of these
// patches and borders of this surface, which would only be counted twice.
bool IsKnown(const SharedPlane& edges,
             std::span<const SharedPlane> patch_planes,
             std::span<const PosedPlanes> scans,
             double corridor_m) {
  Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
  for (const SharedPlane::View& view : edges.views) {
    moments += Moved(scans[view.scan].T_map_scan, view.moments);
  }
  return std::any_of(patch_planes.begin(), patch_planes.end(), [&](const SharedPlane& known) {
    if (RmsDistance(moments, known.plane) > corridor_m) return false;
    const auto common = std::count_if(
        edges.views.begin(), edges.views.end(), [&known](const SharedPlane::View& view) {
          return std::any_of(known.views.begin(), known.views.end(), [&view](const auto& other) {
            return other.scan == view.scan;
          });
        });
    return 2 * common >= std::ssize(edges.views);
  });
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
  std::erase_if(of_edges, [&](const SharedPlane& plane) {
    return IsKnown(plane, planes, scans, options.corridor_m);
  });
  Append(std::move(of_edges), planes);
  return planes;
}

}  // namespace strata
