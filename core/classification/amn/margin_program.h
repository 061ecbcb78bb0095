// The least ½ |w|² + c ξ under cutting planes w · a_t ≥ b_t − ξ, with the last weights not
// negative. Internal to core/classification, not installed.
#ifndef STRATA_CORE_CLASSIFICATION_AMN_MARGIN_PROGRAM_H_
#define STRATA_CORE_CLASSIFICATION_AMN_MARGIN_PROGRAM_H_

#include <vector>

#include <Eigen/Core>

namespace strata {

// Solved in its dual, max b·β − ½ |w|² over β ≥ 0, Σ β ≤ c, by steps along pairs of β; each
// solution starts from the one before.
class MarginProgram {
 public:
  // `non_negative`: how many of the weights, the last ones, must not be negative.
  MarginProgram(Eigen::Index size, Eigen::Index non_negative, double c);

  void AddPlane(const Eigen::VectorXd& a, double b);
  // To a duality gap below `tolerance`, absolute.
  void Solve(double tolerance);

  const Eigen::VectorXd& weights() const { return w_; }
  // The least objective under the planes so far lies between the two.
  double dual() const { return dual_; }
  double primal() const { return primal_; }

 private:
  // Moves up to `room` from β_j to β_i where that gains most; either may be the slack.
  void Step(Eigen::Index i, Eigen::Index j);
  void Update();

  const Eigen::Index non_negative_;
  const double c_;
  std::vector<Eigen::VectorXd> a_;
  std::vector<double> b_;
  std::vector<double> beta_;
  double slack_;         // c − Σ β
  Eigen::VectorXd sum_;  // Σ β a
  Eigen::VectorXd w_;    // sum_, its last part not negative
  double dual_ = 0.0;
  double primal_ = 0.0;
};

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_AMN_MARGIN_PROGRAM_H_
