#include "core/classification/learners/naive_bayes.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>

#include "core/common/option_checks.h"
#include "core/common/status.h"

namespace strata {
namespace {

// Share of a feature's variance over all points that a class has at least.
constexpr double kLeastShare = 1e-6;

}  // namespace

absl::StatusOr<NaiveBayes> LearnNaiveBayes(const LabelledFeatures& data,
                                           const NaiveBayesOptions& options) {
  STRATA_RETURN_IF_ERROR(Validate(data));
  OptionChecks checks("naive bayes options");
  checks.InRange("shared_share", options.shared_share, 0.0, 1.0);
  STRATA_RETURN_IF_ERROR(checks.status());
  const auto classes = static_cast<Eigen::Index>(data.classes);
  const Eigen::Index d = data.features.cols();
  const Eigen::MatrixXd x = data.features.cast<double>();
  const Eigen::RowVectorXd centre = x.colwise().mean();
  // Features that never change carry nothing; any variance serves.
  const Eigen::VectorXd shared =
      ((x.rowwise() - centre).colwise().squaredNorm() / static_cast<double>(x.rows()))
          .transpose()
          .unaryExpr([](double v) { return v > 0.0 ? v : 1.0; });
  NaiveBayes model;
  model.mean = Eigen::MatrixXd::Zero(classes, d);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(classes);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const auto k = data.labels[static_cast<std::size_t>(i)];
    model.mean.row(k) += x.row(i);
    count[k] += 1.0;
  }
  model.mean.array().colwise() /= count.array();
  model.covariance.assign(data.classes, Eigen::MatrixXd::Zero(d, d));
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const auto k = data.labels[static_cast<std::size_t>(i)];
    const Eigen::VectorXd r = (x.row(i) - model.mean.row(k)).transpose();
    model.covariance[k].selfadjointView<Eigen::Lower>().rankUpdate(r, 1.0 / count[k]);
  }
  for (Eigen::MatrixXd& covariance : model.covariance) {
    Eigen::MatrixXd full = covariance.selfadjointView<Eigen::Lower>();
    full *= 1.0 - options.shared_share;
    full.diagonal() += (options.shared_share + kLeastShare) * shared;
    covariance = std::move(full);
  }
  model.log_prior = options.uniform_prior ? Eigen::VectorXd::Constant(
                                                classes, -std::log(static_cast<double>(classes)))
                                          : (count / count.sum()).array().log().matrix().eval();
  return model;
}

ScoreMatrix NaiveBayesScores(const NaiveBayes& model, const FeatureMatrix& features) {
  const double log_two_pi = std::log(2.0 * std::numbers::pi);
  ScoreMatrix scores(features.rows(), model.mean.rows());
  const Eigen::MatrixXd x = features.cast<double>().transpose();
  for (Eigen::Index k = 0; k < model.mean.rows(); ++k) {
    const Eigen::LLT<Eigen::MatrixXd> factor(model.covariance[static_cast<std::size_t>(k)]);
    const Eigen::MatrixXd lower = factor.matrixL();
    const Eigen::MatrixXd whitened =
        lower.triangularView<Eigen::Lower>().solve(x.colwise() - model.mean.row(k).transpose());
    const double constant = model.log_prior[k] - lower.diagonal().array().log().sum() -
                            0.5 * static_cast<double>(x.rows()) * log_two_pi;
    scores.col(k) =
        (constant - 0.5 * whitened.colwise().squaredNorm().array()).matrix().transpose();
  }
  return scores;
}

}  // namespace strata
