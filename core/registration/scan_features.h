// What registration keeps of one scan's local map.
#ifndef STRATA_CORE_REGISTRATION_SCAN_FEATURES_H_
#define STRATA_CORE_REGISTRATION_SCAN_FEATURES_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>

#include "core/mls/features.h"
#include "core/mls/mls_map.h"

namespace strata {

class ColumnGrid;  // internal
class UprightOffsets;

struct ScanFeatureOptions {
  double samples_per_metre = 4.0;  // FromMap: points along a vertical patch; in [0.1, 100]
  // Features farther than this from the scan's origin are left out; in [1, 10000]. They hold few of
  // a scan's points but spread its search structure.
  double max_range_m = 120.0;
  // Size of the random sample that is matched when the scan is a source; in [0, 1000000], 0 for a
  // scan that is only ever a target. They are most of the cost here and in a registration.
  int sample_count = 2000;
  std::uint64_t seed = 1;
  int neighbours = 16;              // that span a surface element; in [4, 32]
  double neighbour_radius_m = 1.5;  // farther ones do not count; in [0.01, 100]
  // Where the scan was taken from, in its frame; finite. What it saw from one side is not what
  // another scan saw from the other.
  Eigen::Vector3d sensor_origin = Eigen::Vector3d::Zero();
  // The vertical in its frame, as far as anybody knows; of length 1. A robot on a ramp looks up to
  // the underside of a deck that lies below its own horizon.
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  // FromMap: how the map's frame is turned from the scan's (upright_frame.h). Features come in the
  // scan's frame whatever it is.
  Eigen::Matrix3d R_map_scan = Eigen::Matrix3d::Identity();

  // INVALID_ARGUMENT naming every field out of its range.
  absl::Status Validate() const;
};

// A feature and the surface around it.
struct SurfaceElement {
  // The feature, moved along the normal into the plane of its neighbours: evens out the noise of
  // the measurements and of the cells' width across the surface.
  Eigen::Vector3f point = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // unit, sign arbitrary; zero: no surface there
};

struct SampledFeature {
  SurfaceElement element;
  FeatureClass feature_class = FeatureClass::kTraversable;
};

// Of points around p, relative to it: small numbers, for which float suffices.
struct NeighbourMoments {
  int n = 0;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  Eigen::Matrix3f squares = Eigen::Matrix3f::Zero();

  void Add(const Eigen::Vector3f& d) {
    ++n;
    sum += d;
    squares += d * d.transpose();
  }
  Eigen::Vector3f mean() const { return sum / static_cast<float>(n); }
  // Standard deviation along a unit vector.
  float SpreadAlong(const Eigen::Vector3f& direction) const;
};

// Their plane at p. With fewer than four, or if they span none, the normal is zero and the point p.
SurfaceElement ElementAt(const Eigen::Vector3f& p, const NeighbourMoments& neighbours);

// The plane through up to `neighbours` points of `grid` around its feature `p`. When fewer than
// four lie within `radius_m`, or they do not span a plane, the normal is zero and the point `p`.
SurfaceElement FitSurfaceElement(const ColumnGrid& grid,
                                 const Eigen::Vector3f& p,
                                 int neighbours,
                                 float radius_m);

// Registration features of one local map in its scan frame: one point per horizontal patch (cell
// centre, mean height), evenly spaced points along each vertical one, and a sample of both with
// normals. Features are matched within their class only (thesis 7.2.3); so that the underside of
// a deck is not drawn onto its top, level surfaces seen from below are in the class of what cannot
// be driven on. Flat float arrays, immutable, safe to share between threads.
class ScanFeatures {
 public:
  ScanFeatures() = default;
  // A pure function of its arguments. `options` must be valid. A map without patches gives features
  // without points, which overlap with nothing.
  // `offsets`, of this map and options.samples_per_metre, put upright ones where their points are;
  // without, they are in the middles of their cells, too.
  static ScanFeatures FromMap(const MlsMap& local_map,
                              const ScanFeatureOptions& options = {},
                              const UprightOffsets* offsets = nullptr);
  // The same of what ExtractFeatures() gave, in the scan's frame: with the traversability of the
  // patches there are three classes instead of two. Source and target need the same classes.
  static ScanFeatures FromFeatures(std::span<const Feature> features,
                                   const ScanFeatureOptions& options = {});
  // The same of ready points of each class; for features that come from elsewhere.
  static ScanFeatures FromPoints(std::array<std::vector<Eigen::Vector3f>, kFeatureClasses> points,
                                 const ScanFeatureOptions& options = {});

  const std::vector<Eigen::Vector3f>& points(FeatureClass c) const {
    return points_[static_cast<std::size_t>(c)];
  }
  // Seen, too, from a side that is not sure: drawn to no other scan, but nothing looks through it.
  const std::vector<Eigen::Vector3f>& doubtful() const { return doubtful_; }
  // In random order: any prefix is a uniform sample.
  const std::vector<SampledFeature>& sample() const { return sample_; }
  // ScanFeatureOptions::sensor_origin.
  const Eigen::Vector3d& sensor_origin() const { return sensor_origin_; }
  // ScanFeatureOptions::up.
  const Eigen::Vector3d& up() const { return up_; }
  std::size_t size() const;
  std::size_t memory_bytes() const;

 private:
  Eigen::Vector3d sensor_origin_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d up_ = Eigen::Vector3d::UnitZ();
  std::array<std::vector<Eigen::Vector3f>, kFeatureClasses> points_;
  std::vector<Eigen::Vector3f> doubtful_;
  std::vector<SampledFeature> sample_;
};

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_SCAN_FEATURES_H_
