// A Gaussian by its information matrix and vector, as an information filter has it (thesis 10.2.1:
// "the inverse form of a Kalman filter"): what is measured is added.
#ifndef STRATA_CORE_EGOMOTION_INFORMATION_FORM_H_
#define STRATA_CORE_EGOMOTION_INFORMATION_FORM_H_

#include <Eigen/Core>

namespace strata {

// Of n errors about a linearisation point that its owner keeps. Its matrices have their sizes at
// run time: of 17 rows known beforehand, Eigen takes a minute to compile them.
class InformationForm {
 public:
  // REQUIRES: n × n, positive definite.
  explicit InformationForm(const Eigen::MatrixXd& covariance);

  const Eigen::MatrixXd& information() const { return information_; }
  Eigen::MatrixXd Covariance() const;

  // x ← F x + G w, where w are independent and have `variances`. Without an inverse of the
  // covariance (Maybeck 1979, 5.7): with M = F⁻ᵀ Λ F⁻¹ and K = M G (Gᵀ M G + Q⁻¹)⁻¹,
  // Λ ← (I − K Gᵀ) M (I − K Gᵀ)ᵀ + K Q⁻¹ Kᵀ, which stays positive.
  // REQUIRES: F is n × n and can be inverted, G n × the variances, variances > 0, nothing added
  // since Correct().
  void Predict(const Eigen::MatrixXd& F,
               const Eigen::MatrixXd& G,
               const Eigen::VectorXd& variances);

  // A measurement with residual = H x + noise of `covariance`.
  void Add(const Eigen::MatrixXd& H,
           const Eigen::VectorXd& residual,
           const Eigen::MatrixXd& covariance);

  // residualᵀ (H P Hᵀ + R)⁻¹ residual, P the covariance and R the measurement's, and the logarithm
  // of that matrix' determinant.
  struct Innovation {
    double nis = 0.0;
    double log_determinant = 0.0;
  };
  Innovation InnovationOf(const Eigen::MatrixXd& H,
                          const Eigen::VectorXd& residual,
                          const Eigen::MatrixXd& covariance) const;

  // The errors that are most likely after what was added; from then on errors are counted from
  // there.
  Eigen::VectorXd Correct();

 private:
  Eigen::MatrixXd information_;
  Eigen::VectorXd vector_;
};

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_INFORMATION_FORM_H_
