#include <algorithm>
#include <cstddef>
#include <utility>

#include "core/classification/amn/amn_inference.h"
#include "core/classification/amn/amn_learning.h"
#include "core/classification/amn/margin_program.h"
#include "core/common/option_checks.h"
#include "core/common/status.h"

namespace strata {
namespace {

// All weights in one row: those of nodes class by class, then those of edges. A labeling's score is
// their product with Ψ(y).
class CuttingPlanes {
 public:
  CuttingPlanes(const AmnTrainingSet& set, const AmnLearningOptions& options)
      : set_(set),
        options_(options),
        features_(SumsOfFeatures(set)),
        classes_(static_cast<Eigen::Index>(set.classes)),
        c_(options.slack_weight / std::max(1.0, set.TotalCount())),
        program_(classes_ * (features_.cols() + 1), classes_, c_) {
    psi_right_ = PsiOf({set.labels.begin(), set.labels.end()});
  }

  absl::StatusOr<AmnLearning> Run(const Stop& stop) {
    AmnLearning best;
    Eigen::VectorXd best_w = program_.weights();
    for (int k = 0; k < options_.max_iterations; ++k) {
      STRATA_RETURN_IF_ERROR(stop.status());
      // Far from the best point so far the planes say little: where they have their least is often
      // worse. A part of the way there, either a better point or a better bound is found
      // (Ben-Ameur, Neto 2007).
      const Eigen::VectorXd w = best_w + kStep * (program_.weights() - best_w);
      STRATA_ASSIGN_OR_RETURN(const Plane plane, MostViolated(w, stop));
      const double slack = std::max(0.0, plane.b - w.dot(plane.a));
      const double objective = 0.5 * w.squaredNorm() + c_ * slack;
      if (k == 0 || objective < best.objective) {
        best.objective = objective;
        best_w = w;
      }
      best.iterations = k + 1;
      best.lower_bound = std::max(best.lower_bound, program_.dual());
      const double gap = best.objective - best.lower_bound;
      best.converged = gap <= options_.tolerance * best.objective;
      if (best.converged) break;
      program_.AddPlane(plane.a, plane.b);
      program_.Solve(kProgramShare * std::max(gap, options_.tolerance * best.objective));
    }
    best.weights = Unpack(best_w);
    return best;
  }

 private:
  // The program under the planes needs to be known better than what planes are added for.
  static constexpr double kProgramShare = 0.05;
  static constexpr double kStep = 0.25;

  struct Plane {
    Eigen::VectorXd a;  // Ψ(ŷ) − Ψ(y)
    double b = 0.0;     // how many points y has wrong
  };

  // Over the points that a row stands for.
  static ScoreMatrix SumsOfFeatures(const AmnTrainingSet& set) {
    ScoreMatrix sums = set.features.cast<double>();
    for (std::size_t i = 0; i < set.labels.size(); ++i) {
      sums.row(static_cast<Eigen::Index>(i)) *= set.Count(i);
    }
    return sums;
  }

  AmnWeights Unpack(const Eigen::VectorXd& w) const {
    AmnWeights weights;
    const Eigen::Index d = features_.cols();
    weights.node.resize(classes_, d);
    for (Eigen::Index k = 0; k < classes_; ++k) weights.node.row(k) = w.segment(k * d, d);
    weights.edge = w.tail(classes_);
    return weights;
  }

  Eigen::VectorXd PsiOf(const std::vector<ClassIndex>& labels) const {
    const Eigen::Index d = features_.cols();
    Eigen::VectorXd psi = Eigen::VectorXd::Zero(classes_ * (d + 1));
    for (std::size_t i = 0; i < labels.size(); ++i) {
      psi.segment(labels[i] * d, d) += features_.row(static_cast<Eigen::Index>(i));
      psi[classes_ * d + labels[i]] += set_.InnerEdges(i);
    }
    for (const NetworkEdge& edge : set_.edges) {
      if (labels[edge.i] == labels[edge.j]) psi[classes_ * d + labels[edge.i]] += 1.0;
    }
    return psi;
  }

  // Scores that also count wrong labels.
  AmnProblem Augmented(const Eigen::VectorXd& w) const {
    AmnProblem problem;
    const AmnWeights weights = Unpack(w);
    problem.node_scores = features_ * weights.node.transpose();
    for (std::size_t i = 0; i < set_.labels.size(); ++i) {
      auto scores = problem.node_scores.row(static_cast<Eigen::Index>(i));
      scores += set_.InnerEdges(i) * weights.edge.transpose();
      scores.array() += set_.Count(i);
      scores[set_.labels[i]] -= set_.Count(i);
    }
    problem.edges = set_.edges;
    problem.edge_scores = weights.edge;
    return problem;
  }

  absl::StatusOr<Plane> MostViolated(const Eigen::VectorXd& w, const Stop& stop) const {
    STRATA_ASSIGN_OR_RETURN(const AmnLabels worst, MaximizeScore(Augmented(w), stop));
    Plane plane;
    plane.a = psi_right_ - PsiOf(worst.labels);
    for (std::size_t i = 0; i < worst.labels.size(); ++i) {
      plane.b += worst.labels[i] != set_.labels[i] ? set_.Count(i) : 0.0;
    }
    return plane;
  }

  const AmnTrainingSet& set_;
  const AmnLearningOptions& options_;
  const ScoreMatrix features_;
  const Eigen::Index classes_;
  const double c_;
  MarginProgram program_;
  Eigen::VectorXd psi_right_;
};

}  // namespace

absl::Status AmnLearningOptions::Validate() const {
  OptionChecks checks("amn learning options");
  checks.InRange("slack_weight", slack_weight, 1e-12, 1e12);
  checks.InRange("tolerance", tolerance, 1e-12, 1.0);
  checks.InRange("max_iterations", max_iterations, 1, 100000);
  return checks.status();
}

absl::StatusOr<AmnLearning> LearnByCuttingPlanes(const AmnTrainingSet& set,
                                                 const AmnLearningOptions& options,
                                                 const Stop& stop) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  return CuttingPlanes(set, options).Run(stop);
}

}  // namespace strata
