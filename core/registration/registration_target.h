// What a new scan is matched to: the features of one scan or of several neighbouring ones.
#ifndef STRATA_CORE_REGISTRATION_REGISTRATION_TARGET_H_
#define STRATA_CORE_REGISTRATION_REGISTRATION_TARGET_H_

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/mls/features.h"
#include "core/registration/scan_features.h"

namespace strata {

class ColumnGrid;  // internal

// A scan already in place.
struct PlacedScan {
  const ScanFeatures* features = nullptr;  // not null; used during the call only
  Pose T_target_scan = Pose::Identity();
};

struct TargetOptions {
  // Features of several scans that share a cube of this edge and a class are averaged into one
  // [m]; in [0, 10], 0 keeps all. A single scan is never thinned.
  double thinning_m = 0.1;
  // Each scan was seen from its sensor; false for what many scans have made.
  bool from_one_place = true;
  // Features farther than this (horizontally) from the centre are left out [m]; in [1, 10000].
  double radius_m = 120.0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // target frame; usually the guess

  absl::Status Validate() const;
};

// What several scans saw of a cube, apart by the side they saw it from: both faces of a thin wall
// may lie in one.
struct SeenSide {
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  Eigen::Vector3f toward = Eigen::Vector3f::Zero();  // sum of unit vectors to the sensors
  float count = 0.0F;                                // 0: nothing was seen from here
};
using SeenSides = std::array<SeenSide, 2>;

// Class-wise search structure over the union. A pure function of its arguments and their order.
// Coordinates are kept relative to the centre, so that the target frame may be far away. Immutable,
// safe to share between threads.
class RegistrationTarget {
 public:
  RegistrationTarget() : RegistrationTarget(std::span<const PlacedScan>()) {}
  explicit RegistrationTarget(std::span<const PlacedScan> scans, const TargetOptions& options = {});

  const ColumnGrid& grid(FeatureClass c) const { return *grids_[static_cast<std::size_t>(c)]; }
  // Where it was seen from, in the grids' coordinates; which saw what is not known. Empty: that is
  // not known either.
  const std::vector<Eigen::Vector3d>& sensors() const { return sensors_; }
  // Of each of grid(kVertical).points() if several scans were averaged; empty otherwise.
  const std::vector<SeenSides>& upright_sides() const { return upright_sides_; }
  // Of each of grid(kTraversable).points() if several scans were averaged: the sum of the unit
  // vectors to their sensors where all looked up to it, by 3° or more; else zero. Empty otherwise.
  const std::vector<Eigen::Vector3f>& toward_below() const { return toward_below_; }
  // Origin of the grids' coordinates, in the target frame.
  const Eigen::Vector3d& origin() const { return origin_; }
  std::size_t size() const;
  std::size_t memory_bytes() const;

 private:
  std::array<std::shared_ptr<const ColumnGrid>, kFeatureClasses> grids_;  // never null
  std::vector<Eigen::Vector3d> sensors_;
  std::vector<SeenSides> upright_sides_;
  std::vector<Eigen::Vector3f> toward_below_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
};

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_REGISTRATION_TARGET_H_
