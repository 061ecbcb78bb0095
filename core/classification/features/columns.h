// What is above and below points in upright columns of a cloud.
// Internal to core/classification, not installed.
#ifndef STRATA_CORE_CLASSIFICATION_FEATURES_COLUMNS_H_
#define STRATA_CORE_CLASSIFICATION_FEATURES_COLUMNS_H_

#include <span>
#include <vector>

#include <Eigen/Core>

namespace strata {

// How a point stands in its column.
struct ColumnPlace {
  float above_m = 0.0F;  // from the point to the highest one
  float below_m = 0.0F;  // from the lowest one to the point
  // Share of the levels of a quarter of a metre from the ground to the point in which there are
  // points: 1 on a wall or a trunk, little on a wire or under a crown.
  float filled = 1.0F;
};

// Where every point is in its square column of `edge_m`. `ground_m`: heights of the ground under
// the points. Points must be finite and within 2³⁰ columns of zero.
std::vector<ColumnPlace> ColumnPlaces(std::span<const Eigen::Vector3f> points,
                                      std::span<const float> ground_m,
                                      double edge_m);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_FEATURES_COLUMNS_H_
