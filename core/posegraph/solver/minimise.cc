#include "core/posegraph/solver/minimise.h"

#include <algorithm>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <ceres/types.h>

#include "core/common/status.h"

// Functions of GCC's libgomp, whose header clang does not find.
extern "C" {
int omp_get_max_active_levels(void);
void omp_set_max_active_levels(int levels);
}

namespace strata {
namespace {

// The inverse of damping. Ceres' own start of 1e4 takes a pose graph up to four times the
// iterations; where a long step leads astray, 1e12 takes a third more.
constexpr double kFirstRadius = 1e9;
constexpr double kMinRadius = 1e-12;
// A χ² that tells nothing: of measurements without noise, where shares of the cost are of rounding.
constexpr double kNegligible = 1e-9;
// Of a decrease over the expected one, and of a decrease over the one before: Gauss-Newton near its
// minimum.
constexpr double kAsExpected = 0.9;
constexpr double kFast = 0.1;

// CHOLMOD asks OpenMP for four threads, whatever Ceres was told; they spin for longer than they
// work. While this lives the calling thread gets none; others are not concerned.
class OneThread {
 public:
  OneThread() : levels_(omp_get_max_active_levels()) { omp_set_max_active_levels(0); }
  ~OneThread() { omp_set_max_active_levels(levels_); }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  const int levels_;
};

// Asked after each iteration. Ceres' own tolerances know nothing of what a step was expected to
// gain, and leave the last step out.
class Watch final : public ceres::IterationCallback {
 public:
  Watch(const ConvergenceOptions& convergence, const Stop& stop)
      : convergence_(convergence), stop_(stop) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& iteration) override {
    status_ = stop_.status();
    if (!status_.ok()) return ceres::SOLVER_ABORT;
    const bool done = HasConverged(iteration) || NothingIsLeft(iteration);
    last_decrease_ = AsExpected(iteration) ? iteration.cost_change : 0.0;
    return done ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  const absl::Status& status() const { return status_; }

 private:
  // Ceres' costs are half a χ².
  bool HasConverged(const ceres::IterationSummary& iteration) const {
    if (iteration.iteration == 0 || !iteration.step_is_valid) return false;
    const double before = 2.0 * (iteration.cost + iteration.cost_change);
    const double decrease = 2.0 * iteration.cost_change;
    const double expected =
        iteration.relative_decrease == 0.0 ? decrease : decrease / iteration.relative_decrease;
    const double negligible = convergence_.cost_tolerance * before + kNegligible;
    const bool small = expected <= negligible || iteration.step_norm <= convergence_.step_tolerance;
    return small && decrease <= negligible;
  }

  static bool AsExpected(const ceres::IterationSummary& iteration) {
    return iteration.step_is_successful && iteration.relative_decrease >= kAsExpected;
  }

  // Whether all steps that may follow gain too little together: they shrink at least as the last
  // two did, which both did what was expected of them. Spares the step that would only show it.
  bool NothingIsLeft(const ceres::IterationSummary& iteration) const {
    if (!AsExpected(iteration)) return false;
    const double shrinking = iteration.cost_change / last_decrease_;
    if (!(shrinking <= kFast)) return false;
    return iteration.cost_change * shrinking / (1.0 - shrinking) <=
           convergence_.cost_tolerance * iteration.cost;
  }

  const ConvergenceOptions& convergence_;
  const Stop& stop_;
  absl::Status status_;
  double last_decrease_ = 0.0;  // of the step before, 0 where it disappointed
};

PoseGraphTermination TerminationOf(const ceres::Solver::Summary& summary) {
  switch (summary.termination_type) {
    case ceres::NO_CONVERGENCE:
      return PoseGraphTermination::kMaxIterations;
    case ceres::FAILURE:  // numbers that are not finite
      return PoseGraphTermination::kNoProgress;
    default:
      return !summary.iterations.empty() &&
                     summary.iterations.back().trust_region_radius <= kMinRadius
                 ? PoseGraphTermination::kNoProgress
                 : PoseGraphTermination::kConverged;
  }
}

}  // namespace

absl::StatusOr<Minimum> Minimise(ceres::Problem& problem,
                                 const ConvergenceOptions& convergence,
                                 const Stop& stop) {
  Watch watch(convergence, stop);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.callbacks = {&watch};
  options.max_num_iterations = convergence.max_iterations;
  options.function_tolerance = 0.0;
  options.gradient_tolerance = 0.0;
  options.parameter_tolerance = 0.0;
  options.initial_trust_region_radius = kFirstRadius;
  options.min_trust_region_radius = kMinRadius;
  options.max_num_consecutive_invalid_steps = 100;  // the radius ends it before
  const OneThread one_thread;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  STRATA_RETURN_IF_ERROR(watch.status());
  return Minimum{.iterations = std::max(0, summary.num_linear_solves),
                 .termination = TerminationOf(summary)};
}

}  // namespace strata
