// How well a thing fits the shape of a kind (thesis 11.2.2).
// Internal to core, not installed: whoever includes it links nanoflann.
#ifndef STRATA_CORE_COMPLETION_KIND_MODEL_H_
#define STRATA_CORE_COMPLETION_KIND_MODEL_H_

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/completion/thing_points.h"
#include "core/geometry/pose.h"

namespace strata {

// How a thing lies on a kind.
struct KindFit {
  Pose T_kind_thing = Pose::Identity();
  double residual_m = 0.0;  // RMS distance from the kind's surface, of the points that lie on it
  double overlap = 0.0;     // their share of the thing's points
  double cover = 0.0;       // share of the kind's points where the thing has one

  // Smaller is better; in [0, 3.5] where the residual is within the tolerance.
  double Badness(double tolerance_m) const {
    return residual_m / tolerance_m + 2.0 * (1.0 - overlap) + 0.5 * (1.0 - cover);
  }
  // The same of a thing that was seen in part: what it lacks may be hidden, but what of it lies
  // beside the kind says that it is of another.
  double BadnessOfPart(double tolerance_m) const {
    return residual_m / tolerance_m + 6.0 * (1.0 - overlap) + 0.1 * (1.0 - cover);
  }
};

// Where a thing may stand on a kind before it is registered.
enum class KindStarts {
  kCentred,  // the middles of both above each other: things of which as much was seen
  // Also side on side, and below the top: things that are hidden in part.
  kSideOnSide,
};

// A kind's shape, ready for things to be registered to it. Safe to read from several threads.
class KindModel {
 public:
  // Points that are so near to a surface lie on it; where points are sparse, it grows with their
  // spacing. REQUIRES: at least kMinKindPoints points,
  // finite.
  KindModel(std::vector<Eigen::Vector3f> points, double tolerance_m);

  const ThingPoints& thing() const { return thing_; }
  double tolerance_m() const { return tolerance_m_; }

  // Whether a registration may be worth its time: the share of some points of the thing that lie
  // within voxels of the kind.
  struct Start {
    Pose T_kind_thing = Pose::Identity();
    double share = 0.0;
    double distance_m = 0.0;  // mean of the points from the kind's
  };
  // Turned about z by sixteenths, the best three, the nearest first; those with less than two
  // thirds are left out.
  std::vector<Start> StartsOf(const ThingPoints& thing, KindStarts starts) const;

  // The best registration from these; nullopt where none of them has the thing on the kind, or it
  // fell over.
  std::optional<KindFit> Register(const ThingPoints& thing, const std::vector<Start>& starts) const;

 private:
  void AddStarts(const ThingPoints& thing,
                 const std::vector<Eigen::Vector3f>& samples,
                 double angle,
                 bool sides,
                 std::vector<Start>& starts) const;
  double DistanceFrom(const Pose& T_kind_thing, const std::vector<Eigen::Vector3f>& samples) const;
  bool HasVoxelAt(const Eigen::Vector3f& p) const;
  void FillVoxels();
  void FillNormals();
  // Trimmed ICP, point to plane, of every so manyth point.
  Pose Refine(const ThingPoints& thing,
              const Pose& T_guess,
              std::size_t samples,
              int iterations,
              double first_reach_m) const;
  KindFit Measure(const ThingPoints& thing, const Pose& T_kind_thing, std::size_t samples) const;

  const ThingPoints thing_;
  const double tolerance_m_;
  const double reach_m_;  // to the nearest of its points from a point on its surface
  std::vector<Eigen::Vector3f> normals_;
  double voxel_m_ = 0.0;
  Eigen::Array3i counts_ = Eigen::Array3i::Zero();
  std::vector<bool> voxels_;  // with those around each point
};

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_KIND_MODEL_H_
