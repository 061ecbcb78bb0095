// How well a pose graph keeps what its constraints say.
#ifndef STRATA_CLIENT_CLI_POSEGRAPH_CONSTRAINT_RESIDUAL_H_
#define STRATA_CLIENT_CLI_POSEGRAPH_CONSTRAINT_RESIDUAL_H_

#include <vector>

#include "core/api/posegraph.h"

namespace strata::cli {

struct ConstraintResidual {
  const Constraint* constraint = nullptr;
  Pose T_map_i = Pose::Identity();  // of a prior: where it says that j is
  Pose T_map_j = Pose::Identity();
  // eᵀ Ω e over the number of directions that Ω says something about; about 1 where noise is all.
  // With Δ = T_i_j⁻¹ T_map_i⁻¹ T_map_j, e = [2 · vector part of its quaternion, translation], the
  // error that optimize minimises.
  double normalised_chi2 = 0.0;
  double rotation_rad = 0.0;   // length of e's rotation
  double translation_m = 0.0;  // length of e's translation
};

// By id, those whose scans are nodes of `state`, which must outlive the result.
std::vector<ConstraintResidual> ResidualsOf(const api::PoseGraphState& state);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_POSEGRAPH_CONSTRAINT_RESIDUAL_H_
