// Where roughly does a scan fit into a target? Tries every shift and heading of a window on images
// of both from above (Olson, "Real-time correlative scan matching", ICRA 2009).
// Internal to core/registration, not installed.
#ifndef STRATA_CORE_REGISTRATION_PLACE_SEARCH_H_
#define STRATA_CORE_REGISTRATION_PLACE_SEARCH_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/registration/registration_target.h"
#include "core/registration/scan_features.h"

namespace strata {

struct PlaceHypothesis;

// A local maximum of the score.
struct CoarsePlace {
  // Of the source turned upright (UprightTurn): its z axis is the target's.
  Pose T_target_upright = Pose::Identity();
  double score = 0.0;  // share of the source's structure that fits, in [0, 1]
};

// The images of one source and one target; several hypotheses may be searched.
class PlaceSearch {
 public:
  PlaceSearch(const ScanFeatures& source, const RegistrationTarget& target);

  // At most `count` places of the upright source within the hypothesis' window that differ by more
  // than 3 m, 10° or a storey, best first.
  std::vector<CoarsePlace> Search(const PlaceHypothesis& hypothesis, std::size_t count) const;

 private:
  struct Structure {
    Eigen::Vector2d p;
    double weight;
  };
  double Score(const std::vector<Structure>& turned, const Eigen::Vector2d& shift) const;
  // Heights at which the source's ground meets the target's, within `range_m` of `middle_m`.
  std::vector<double> Heights(double heading_rad,
                              const Eigen::Vector2d& shift,
                              double middle_m,
                              double range_m) const;

  std::vector<Structure> structure_;     // of the source
  std::vector<Eigen::Vector3d> ground_;  // of the source, a sample
  Eigen::Vector3d origin_;               // of the target's coordinates
  // The target's image, row after row.
  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();
  int columns_ = 0;
  int rows_ = 0;
  std::vector<float> image_;
  std::vector<std::vector<float>> levels_;
};

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_PLACE_SEARCH_H_
