#include "core/posegraph/solver/levenberg_marquardt.h"

#include <algorithm>
#include <cmath>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/status.h"

namespace strata {
namespace {

constexpr double kFirstDamping = 1e-6;
constexpr double kMinDamping = 1e-15;
constexpr double kMaxDamping = 1e12;
// A χ² that tells nothing: of measurements without noise, where shares of the cost are of rounding.
constexpr double kNegligible = 1e-9;
// Every parameter is damped at least like this share of the strongest: one without any term stays.
constexpr double kMinDiagonalShare = 1e-12;

// How much of the next steps is held back.
class Damping {
 public:
  double value() const { return value_; }
  bool exhausted() const { return value_ > kMaxDamping; }
  // `gain` is the decrease over the expected decrease.
  void Lower(double gain) {
    value_ *= std::max(1.0 / 9.0, 1.0 - std::pow(2.0 * gain - 1.0, 3));
    value_ = std::max(value_, kMinDamping);
    factor_ = 2.0;
  }
  void Raise() {
    value_ *= factor_;
    factor_ *= 2.0;
  }

 private:
  double value_ = kFirstDamping;
  double factor_ = 2.0;
};

}  // namespace

absl::StatusOr<Minimum> Minimise(LeastSquares& problem,
                                 BlockCholesky& H,
                                 const ConvergenceOptions& options,
                                 const Stop& stop) {
  Minimum result{.cost = problem.Cost()};
  Damping damping;
  Eigen::VectorXd gradient;
  Eigen::VectorXd diagonal;
  bool linearised = false;
  while (true) {
    STRATA_RETURN_IF_ERROR(stop.status());
    if (!linearised) {
      std::fill(H.values().begin(), H.values().end(), 0.0);
      problem.Linearise(H, gradient);
      diagonal = H.Diagonal();
      problem.AverageByKind(diagonal);
      const double floor = std::max(diagonal.maxCoeff() * kMinDiagonalShare, 1e-300);
      diagonal = diagonal.cwiseMax(floor);
      linearised = true;
    }
    if (result.iterations == options.max_iterations) {
      result.termination = PoseGraphTermination::kMaxIterations;
      return result;
    }
    ++result.iterations;
    const Eigen::VectorXd damped = damping.value() * diagonal;
    bool lowered = false;
    double gain = 0.0;
    if (H.Factor(damped)) {
      const Eigen::VectorXd step = -H.Solve(gradient);
      const double expected = -gradient.dot(step) + step.dot(damped.cwiseProduct(step));
      const double cost = problem.Try(step);
      const double decrease = result.cost - cost;
      const double negligible = options.cost_tolerance * result.cost + kNegligible;
      const bool small =
          expected <= negligible || step.lpNorm<Eigen::Infinity>() <= options.step_tolerance;
      lowered = decrease >= 0.0;
      if (lowered) {
        problem.Accept();
        result.cost = cost;
        linearised = false;
        gain = expected > 0.0 ? decrease / expected : 1.0;
      }
      if (small && decrease <= negligible) return result;
    }
    if (lowered) {
      damping.Lower(std::min(gain, 1.0));
    } else {
      damping.Raise();
      if (damping.exhausted()) {
        result.termination = PoseGraphTermination::kNoProgress;
        return result;
      }
    }
  }
}

}  // namespace strata
