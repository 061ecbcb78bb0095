#include "core/egomotion/information_form.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

namespace strata {
namespace {

Eigen::MatrixXd Symmetric(const Eigen::MatrixXd& matrix) {
  return 0.5 * (matrix + matrix.transpose());
}

Eigen::MatrixXd SymmetricInverse(const Eigen::MatrixXd& matrix) {
  return Symmetric(matrix.llt().solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols())));
}

}  // namespace

InformationForm::InformationForm(const Eigen::MatrixXd& covariance)
    : information_(SymmetricInverse(covariance)),
      vector_(Eigen::VectorXd::Zero(covariance.rows())) {}

Eigen::MatrixXd InformationForm::Covariance() const { return SymmetricInverse(information_); }

void InformationForm::Predict(const Eigen::MatrixXd& F,
                              const Eigen::MatrixXd& G,
                              const Eigen::VectorXd& variances) {
  const Eigen::MatrixXd F_inverse = F.partialPivLu().inverse();
  const Eigen::MatrixXd LF = information_ * F_inverse;
  const Eigen::MatrixXd M = F_inverse.transpose() * LF;
  const Eigen::MatrixXd Q_inverse = variances.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd MG = M * G;
  Eigen::MatrixXd inner = G.transpose() * MG;
  inner += Q_inverse;
  const Eigen::MatrixXd K_transpose = Symmetric(inner).llt().solve(MG.transpose());
  // (I − K Gᵀ)ᵀ.
  Eigen::MatrixXd kept = -(G * K_transpose);
  kept.diagonal().array() += 1.0;
  const Eigen::MatrixXd M_kept = M * kept;
  const Eigen::MatrixXd weighted = Q_inverse * K_transpose;
  Eigen::MatrixXd predicted = kept.transpose() * M_kept;
  predicted.noalias() += K_transpose.transpose() * weighted;
  information_ = Symmetric(predicted);
}

void InformationForm::Add(const Eigen::MatrixXd& H,
                          const Eigen::VectorXd& residual,
                          const Eigen::MatrixXd& covariance) {
  const Eigen::MatrixXd weighted = covariance.llt().solve(H);  // R⁻¹ H
  Eigen::MatrixXd information = information_;
  information.noalias() += weighted.transpose() * H;
  information_ = Symmetric(information);
  vector_.noalias() += weighted.transpose() * residual;
}

InformationForm::Innovation InformationForm::InnovationOf(const Eigen::MatrixXd& H,
                                                          const Eigen::VectorXd& residual,
                                                          const Eigen::MatrixXd& covariance) const {
  const Eigen::MatrixXd PH = information_.llt().solve(H.transpose());
  Eigen::MatrixXd S = covariance;
  S.noalias() += H * PH;
  const Eigen::LLT<Eigen::MatrixXd> root(S);
  const Eigen::VectorXd whitened = root.matrixL().solve(residual);
  return {whitened.squaredNorm(), 2.0 * root.matrixLLT().diagonal().array().log().sum()};
}

Eigen::VectorXd InformationForm::Correct() {
  const Eigen::VectorXd step = information_.llt().solve(vector_);
  vector_.setZero();
  return step;
}

}  // namespace strata
