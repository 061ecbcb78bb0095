#include "core/planes/patch_association.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include <Eigen/Core>

#include "core/geometry/primitives.h"
#include "core/planes/moments.h"
#include "core/planes/posed_patch.h"
#include "core/planes/scan_planes.h"
#include "core/planes/shared_planes.h"

namespace strata {
namespace {

constexpr double kCubeM = 8.0;

// Patches by the cubes of space that their boxes touch.
class PatchIndex {
 public:
  explicit PatchIndex(std::span<const PosedPatch> patches) {
    for (std::uint32_t i = 0; i < patches.size(); ++i) {
      ForCubes(patches[i].box, [&](const Cube& cube) { cubes_[cube].push_back(i); });
    }
  }

  // Those that may touch the box, ascending.
  std::vector<std::uint32_t> Near(const Eigen::AlignedBox3d& box) const {
    std::vector<std::uint32_t> near;
    ForCubes(box, [&](const Cube& cube) {
      const auto found = cubes_.find(cube);
      if (found != cubes_.end())
        near.insert(near.end(), found->second.begin(), found->second.end());
    });
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    return near;
  }

 private:
  using Cube = std::array<std::int64_t, 3>;
  template <typename Visit>
  static void ForCubes(const Eigen::AlignedBox3d& box, Visit visit) {
    const Eigen::Vector3d low = (box.min() / kCubeM).array().floor();
    const Eigen::Vector3d high = (box.max() / kCubeM).array().floor();
    for (auto x = static_cast<std::int64_t>(low.x()); x <= static_cast<std::int64_t>(high.x());
         ++x) {
      for (auto y = static_cast<std::int64_t>(low.y()); y <= static_cast<std::int64_t>(high.y());
           ++y) {
        for (auto z = static_cast<std::int64_t>(low.z()); z <= static_cast<std::int64_t>(high.z());
             ++z) {
          visit(Cube{x, y, z});
        }
      }
    }
  }
  absl::flat_hash_map<Cube, std::vector<std::uint32_t>> cubes_;
};

// The plane of the information, its normal to the side of `side`.
Plane PlaneOf(const Eigen::Matrix4d& information, const Eigen::Vector3d& side) {
  const Plane plane = FitMoments(information).plane;
  if (plane.normal.dot(side) >= 0.0) return plane;
  return {.normal = -plane.normal, .distance = -plane.distance};
}

class PatchAssociation {
 public:
  PatchAssociation(std::vector<PosedPatch> patches, const SharedPlaneOptions& options)
      : patches_(std::move(patches)),
        options_(options),
        index_(patches_),
        taken_(patches_.size(), false),
        seen_by_(patches_.size(), 0) {}

  std::vector<SharedPlane> Run() {
    std::vector<std::uint32_t> order(patches_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(), [this](std::uint32_t a, std::uint32_t b) {
      return patches_[a].patch->area_m2 > patches_[b].patch->area_m2;
    });
    std::vector<SharedPlane> planes;
    for (const std::uint32_t seed : order) {
      if (taken_[seed]) continue;
      std::vector<std::uint32_t> group = Grow(seed);
      KeepWhatFits(group);
      if (ScanCount(group) < 2) continue;
      for (const std::uint32_t i : group) taken_[i] = true;
      planes.push_back(PlaneOfGroup(group));
    }
    return planes;
  }

 private:
  std::vector<std::uint32_t> Grow(std::uint32_t seed) {
    ++seeds_;
    std::vector<std::uint32_t> group = {seed};
    seen_by_[seed] = seeds_;
    Eigen::Matrix4d information = patches_[seed].information;
    Plane plane = patches_[seed].plane;
    for (std::size_t next = 0; next < group.size(); ++next) {
      const PosedPatch& member = patches_[group[next]];
      for (const std::uint32_t i : index_.Near(member.box)) {
        const PosedPatch& candidate = patches_[i];
        if (taken_[i] || seen_by_[i] == seeds_ ||
            Distance(candidate.centroid, patches_[seed].centroid) > options_.max_extent_m ||
            !FitsPlane(candidate, plane, options_) ||
            Overlap(candidate, member) < options_.min_overlap) {
          continue;
        }
        seen_by_[i] = seeds_;
        if (!AgreesWithItsScan(candidate, group)) continue;
        group.push_back(i);
        information += candidate.information;
        plane = PlaneOf(information, plane.normal);
      }
    }
    return group;
  }

  bool AgreesWithItsScan(const PosedPatch& candidate, std::span<const std::uint32_t> group) const {
    return std::all_of(group.begin(), group.end(), [&](std::uint32_t i) {
      return patches_[i].scan != candidate.scan || Coplanar(patches_[i], candidate);
    });
  }

  // While a patch does not fit the plane of all other scans, the farthest such leaves.
  void KeepWhatFits(std::vector<std::uint32_t>& group) const {
    while (ScanCount(group) >= 2) {
      Eigen::Matrix4d all = Eigen::Matrix4d::Zero();
      std::map<std::size_t, Eigen::Matrix4d> of_scan;
      for (const std::uint32_t i : group) {
        all += patches_[i].information;
        of_scan.try_emplace(patches_[i].scan, Eigen::Matrix4d::Zero()).first->second +=
            patches_[i].information;
      }
      std::size_t worst = group.size();
      double worst_rms = 0.0;
      for (std::size_t k = 0; k < group.size(); ++k) {
        const PosedPatch& patch = patches_[group[k]];
        const Plane others = PlaneOf(all - of_scan.at(patch.scan), patch.plane.normal);
        if (FitsPlane(patch, others, options_)) continue;
        const double rms = RmsDistance(patch.information, others);
        if (worst == group.size() || rms > worst_rms) {
          worst = k;
          worst_rms = rms;
        }
      }
      if (worst == group.size()) return;
      group.erase(group.begin() + static_cast<std::ptrdiff_t>(worst));
    }
  }

  std::size_t ScanCount(std::span<const std::uint32_t> group) const {
    std::vector<std::size_t> scans;
    for (const std::uint32_t i : group) scans.push_back(patches_[i].scan);
    std::sort(scans.begin(), scans.end());
    return static_cast<std::size_t>(std::unique(scans.begin(), scans.end()) - scans.begin());
  }

  // Mean square of what the patches' distances to the plane exceed their own spread by.
  double Disagreement(std::span<const std::uint32_t> group, const Plane& plane) const {
    double sum = 0.0;
    double weight = 0.0;
    for (const std::uint32_t i : group) {
      const PosedPatch& p = patches_[i];
      const double own = RmsDistance(p.information, p.plane);
      const double rms = RmsDistance(p.information, plane);
      sum += p.measurements * std::max(0.0, rms * rms - own * own);
      weight += p.measurements;
    }
    return sum / weight;
  }

  SharedPlane PlaneOfGroup(std::span<const std::uint32_t> group) const {
    SharedPlane shared;
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    for (const std::uint32_t i : group) information += patches_[i].information;
    shared.plane = PlaneOf(information, patches_[group.front()].plane.normal);
    const double disagreement = Disagreement(group, shared.plane);
    std::map<std::size_t, SharedPlane::View> views;
    for (const std::uint32_t i : group) {
      const PosedPatch& p = patches_[i];
      SharedPlane::View& view =
          views
              .try_emplace(p.scan,
                           SharedPlane::View{.scan = p.scan, .moments = Eigen::Matrix4d::Zero()})
              .first->second;
      const double weight = p.measurements / (p.variance_m2 + disagreement);
      view.moments += weight / p.patch->moments(3, 3) * p.patch->moments;
      view.weight += p.patch->area_m2;
      view.rms_m += p.patch->area_m2 * std::pow(RmsDistance(p.information, shared.plane), 2);
      shared.support_value += p.patch->area_m2;
    }
    for (auto& [scan, view] : views) {
      view.rms_m = std::sqrt(view.rms_m / view.weight);
      shared.views.push_back(view);
    }
    return shared;
  }

  std::vector<PosedPatch> patches_;
  const SharedPlaneOptions& options_;
  PatchIndex index_;
  std::vector<bool> taken_;
  std::vector<std::uint32_t> seen_by_;  // the last seed that has this patch or refused it
  std::uint32_t seeds_ = 0;
};

}  // namespace

std::vector<SharedPlane> FindPatchPlanes(std::span<const PosedPlanes> scans,
                                         const SharedPlaneOptions& options) {
  std::vector<PosedPatch> patches;
  for (std::size_t scan = 0; scan < scans.size(); ++scan) {
    for (const PlanePatch& patch : scans[scan].planes->patches) {
      patches.push_back(InMap(patch, scan, scans[scan].T_map_scan, options));
    }
  }
  return PatchAssociation(std::move(patches), options).Run();
}

}  // namespace strata
