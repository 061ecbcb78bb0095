// Fewer training points that say the same (thesis 9.3).
//
// A point that stands for several is at their mean, and has the features of the one nearest to it:
// those were computed in the full cloud, so that learning sees what inference will see. Means of
// features are smoother than features of points are, and a classifier learned from them is too
// sure; features computed anew among the fewer points would be those of another, coarser sensor.
//
// Networks are learned as if all points were there, but those of one leaf shared one label: a leaf
// weighs as many points as it stands for, and keeps the edges of its points (Contract() in
// network.h). A network drawn among the leaves themselves would be one of borders: neighbours there
// differ far more often than they do where inference will look, and its edges are learned too weak.
// Points that were drawn are joined to the nearest that were drawn, too: their whole neighbourhoods
// were tried and are no better (docs/decisions/0099).
#ifndef STRATA_CORE_CLASSIFICATION_REDUCTION_H_
#define STRATA_CORE_CLASSIFICATION_REDUCTION_H_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/classification/features/labelled_features.h"

namespace strata {

enum class ReductionKind : std::uint8_t {
  kNone,
  kRandom,  // `count` of the points, as they are (9.3)
  kDepth,   // the leaves of a kd-tree of `depth` levels (9.3.1); the commonest label of each
  kPure,    // the largest subtrees of which all labels are equal (9.3.2): no parameter
  // About `count` of the points, as they are, a class by the square root of its number: rare
  // classes are still learned, frequent ones still expected. Unlike leaves, drawn points look as
  // those do that inference will see.
  kBalanced,
};

struct ReductionOptions {
  ReductionKind kind = ReductionKind::kBalanced;
  int depth = 15;              // in [1, 30]
  std::uint32_t count = 5000;  // of every cloud, at least 1
  std::uint64_t seed = 1;

  absl::Status Validate() const;
};

// "auto" (kBalanced), "pure", "none", "depth=N", "random=N"; INVALID_ARGUMENT listing them
// otherwise.
absl::StatusOr<ReductionOptions> ParseReduction(absl::string_view text);

// The text that ParseReduction() reads.
std::string ToString(const ReductionOptions& options);

struct ReducedPoints {
  std::vector<Eigen::Vector3f> positions;
  LabelledFeatures data;
  std::vector<std::uint32_t> counts;  // how many points each stands for
  // With trees (kDepth, kPure): for every point given, which of these stands for it. Empty where
  // points were drawn, or all are kept: they stand for themselves.
  std::vector<std::uint32_t> row_of;
};

// `positions` beside the rows of `data`, which must be valid, as must `options`. Trees
// cut along the widest axis of the points: kDepth halves space, so that what is left depends less
// on how densely it was sampled, kPure halves the points. Deterministic.
ReducedPoints Reduce(std::span<const Eigen::Vector3f> positions,
                     const LabelledFeatures& data,
                     const ReductionOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_REDUCTION_H_
