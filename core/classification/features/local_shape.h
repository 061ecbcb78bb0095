// The shape of a point's neighbourhood: the covariance of what is around it.
#ifndef STRATA_CORE_CLASSIFICATION_FEATURES_LOCAL_SHAPE_H_
#define STRATA_CORE_CLASSIFICATION_FEATURES_LOCAL_SHAPE_H_

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include <Eigen/Core>

#include "core/classification/features/neighbours.h"

namespace strata {

// λ1 ≥ λ2 ≥ λ3 ≥ 0 with their directions; signs are arbitrary. All zero where the neighbourhood is
// one place.
struct LocalShape {
  Eigen::Vector3f values = Eigen::Vector3f::Zero();  // [m²]
  Eigen::Vector3f axis = Eigen::Vector3f::Zero();    // of λ1: along a line
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // of λ3: across a plane

  // Weinmann, Jutzi, Mallet 2013; in [0, 1].
  float linearity() const { return Ratio(values[0] - values[1]); }
  float planarity() const { return Ratio(values[1] - values[2]); }
  float scattering() const { return Ratio(values[2]); }
  float verticality() const { return 1.0F - std::abs(normal.z()); }

 private:
  float Ratio(float part) const { return values[0] > 0.0F ? part / values[0] : 0.0F; }
};

// The shape of the points `around` with the numbers `indices` and of `centre` itself.
LocalShape DescribeShape(const Eigen::Vector3f& centre,
                         std::span<const Eigen::Vector3f> around,
                         std::span<const std::uint32_t> indices);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_FEATURES_LOCAL_SHAPE_H_
