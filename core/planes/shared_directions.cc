#include "core/planes/shared_directions.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "core/planes/posed_patch.h"
#include "core/planes/scan_planes.h"
#include "core/planes/shared_planes.h"

namespace strata {
namespace {

constexpr double kParallelGate = 3.0;
constexpr int kMaxTurns = 20;
// What a scan sees is as parallel as this many surfaces that err by themselves, however many there
// are: they are of few walls.
constexpr double kMostSurfaces = 1.0;
// A main direction has so much of all area; what has less is as parallel by chance.
constexpr double kMinShare = 0.05;

struct FacingPatch {
  std::size_t scan = 0;
  Eigen::Vector3d normal_map, normal_scan;
  double area_m2 = 0.0;
  double variance_rad2 = 0.0;  // of its own angle
  bool taken = false;
};

std::vector<FacingPatch> Facing(std::span<const PosedPlanes> scans,
                                const SharedPlaneOptions& options) {
  std::vector<FacingPatch> facing;
  for (std::size_t scan = 0; scan < scans.size(); ++scan) {
    for (const PlanePatch& patch : scans[scan].planes->patches) {
      const PosedPatch posed = InMap(patch, scan, scans[scan].T_map_scan, options);
      facing.push_back({.scan = scan,
                        .normal_map = posed.plane.normal,
                        .normal_scan = patch.plane.normal,
                        .area_m2 = patch.area_m2,
                        .variance_rad2 = posed.tilt_sigma_rad * posed.tilt_sigma_rad +
                                         kParallelSigmaRad * kParallelSigmaRad});
    }
  }
  std::stable_sort(facing.begin(), facing.end(), [](const FacingPatch& a, const FacingPatch& b) {
    return a.area_m2 > b.area_m2;
  });
  return facing;
}

// The line that normals of unit length lie along best.
Eigen::Vector3d MainAxis(const Eigen::Matrix3d& scatter) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(2);
}

// Those not taken yet that face along `direction`, which is moved to their mean.
std::vector<FacingPatch*> Along(std::vector<FacingPatch>& facing,
                                double pose_variance_rad2,
                                Eigen::Vector3d& direction) {
  std::vector<FacingPatch*> members;
  for (int turn = 0; turn < kMaxTurns; ++turn) {
    std::vector<FacingPatch*> now;
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (FacingPatch& patch : facing) {
      const double variance = patch.variance_rad2 + pose_variance_rad2;
      if (patch.taken || patch.normal_map.cross(direction).squaredNorm() >
                             kParallelGate * kParallelGate * variance) {
        continue;
      }
      now.push_back(&patch);
      scatter += patch.normal_map * patch.normal_map.transpose() / variance;
    }
    if (now == members || now.empty()) break;
    members = std::move(now);
    direction = MainAxis(scatter);
  }
  return members;
}

SharedDirection::View ViewOf(std::size_t scan, const std::vector<const FacingPatch*>& patches) {
  SharedDirection::View view{.scan = scan};
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const FacingPatch* patch : patches) {
    scatter += patch->normal_scan * patch->normal_scan.transpose() / patch->variance_rad2;
    view.information += 1.0 / patch->variance_rad2;
  }
  view.information =
      std::min(view.information, kMostSurfaces / (kParallelSigmaRad * kParallelSigmaRad));
  view.normal_scan = MainAxis(scatter);
  return view;
}

}  // namespace

std::vector<SharedDirection> FindSharedDirections(std::span<const PosedPlanes> scans,
                                                  const SharedPlaneOptions& options) {
  std::vector<FacingPatch> facing = Facing(scans, options);
  double area_m2 = 0.0;
  for (const FacingPatch& patch : facing) area_m2 += patch.area_m2;
  const double pose_variance = options.pose_sigma_rad * options.pose_sigma_rad;
  std::vector<SharedDirection> directions;
  for (FacingPatch& seed : facing) {
    if (seed.taken) continue;
    SharedDirection shared;
    shared.direction_map = seed.normal_map;
    std::map<std::size_t, std::vector<const FacingPatch*>> by_scan;
    for (FacingPatch* patch : Along(facing, pose_variance, shared.direction_map)) {
      patch->taken = true;
      shared.area_m2 += patch->area_m2;
      by_scan[patch->scan].push_back(patch);
    }
    seed.taken = true;
    if (by_scan.size() < 2 || shared.area_m2 < kMinShare * area_m2) continue;
    for (const auto& [scan, patches] : by_scan) shared.views.push_back(ViewOf(scan, patches));
    directions.push_back(std::move(shared));
  }
  std::stable_sort(
      directions.begin(), directions.end(), [](const SharedDirection& a, const SharedDirection& b) {
        return a.area_m2 > b.area_m2;
      });
  return directions;
}

}  // namespace strata
