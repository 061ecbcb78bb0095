// CGAL's classification, behind a door of our own: its headers take long to compile.
#ifndef STRATA_TESTS_BENCH_CLASSIFICATION_PEERS_H_
#define STRATA_TESTS_BENCH_CLASSIFICATION_PEERS_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/classification/amn/amn.h"
#include "core/classification/features/labelled_features.h"

namespace strata::bench {

// What Point_set_feature_generator makes of points at `scales` scales: eigenvalues, dispersion,
// elevation, verticality. One row a point; one thread.
FeatureMatrix CgalFeatures(std::span<const Eigen::Vector3f> points,
                           std::size_t scales,
                           float voxel_m);

// The forest of the ETH with CGAL's defaults (25 trees of depth 20), one thread.
class CgalForest {
 public:
  explicit CgalForest(const LabelledFeatures& data);
  ~CgalForest();

  // Shares of the trees' votes, a row a point.
  ScoreMatrix Probabilities(const FeatureMatrix& features) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

// α-expansion from the best label of every point by itself. Neighbours that differ cost `strength`,
// points what `costs` says (≥ 0). As classify_with_graphcut() calls it, or by the max-flow that
// CGAL's segmentation brings.
enum class GraphCut : std::uint8_t { kBoost, kMaxFlow };
std::vector<ClassIndex> CgalGraphCut(GraphCut method,
                                     const ScoreMatrix& costs,
                                     std::span<const NetworkEdge> edges,
                                     double strength);

}  // namespace strata::bench

#endif  // STRATA_TESTS_BENCH_CLASSIFICATION_PEERS_H_
