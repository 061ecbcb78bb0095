// A Gaussian by its information matrix and vector, as an information filter has it (thesis 10.2.1:
// "the inverse form of a Kalman filter"): what is measured is added.
#ifndef STRATA_CORE_EGOMOTION_INFORMATION_FORM_H_
#define STRATA_CORE_EGOMOTION_INFORMATION_FORM_H_

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

namespace strata {

// Of errors about a linearisation point that its owner keeps.
template <int size>
class InformationForm {
 public:
  using Vector = Eigen::Matrix<double, size, 1>;
  using Matrix = Eigen::Matrix<double, size, size>;

  // REQUIRES: positive definite.
  explicit InformationForm(const Matrix& covariance) : information_(Inverse(covariance)) {}

  const Matrix& information() const { return information_; }
  Matrix Covariance() const { return Inverse(information_); }

  // x ← F x + G w, where w are independent and have `variances`. Without an inverse of the
  // covariance (Maybeck 1979, 5.7): with M = F⁻ᵀ Λ F⁻¹ and K = M G (Gᵀ M G + Q⁻¹)⁻¹,
  // Λ ← (I − K Gᵀ) M (I − K Gᵀ)ᵀ + K Q⁻¹ Kᵀ, which stays positive.
  // REQUIRES: F can be inverted, variances > 0, nothing added since Correct().
  template <int noise>
  void Predict(const Matrix& F,
               const Eigen::Matrix<double, size, noise>& G,
               const Eigen::Matrix<double, noise, 1>& variances) {
    using Noise = Eigen::Matrix<double, noise, noise>;
    const Matrix F_inverse = F.partialPivLu().inverse();
    const Matrix M = F_inverse.transpose() * information_ * F_inverse;
    const Noise Q_inverse = variances.cwiseInverse().asDiagonal();
    const Eigen::Matrix<double, size, noise> MG = M * G;
    const Noise inner = Symmetric<noise>(G.transpose() * MG + Q_inverse);
    const Eigen::Matrix<double, size, noise> K = inner.llt().solve(MG.transpose()).transpose();
    const Matrix kept = Matrix::Identity() - K * G.transpose();
    information_ = Symmetric<size>(kept * M * kept.transpose() + K * Q_inverse * K.transpose());
  }

  // A measurement with residual = H x + noise of `covariance`.
  template <int rows>
  void Add(const Eigen::Matrix<double, rows, size>& H,
           const Eigen::Matrix<double, rows, 1>& residual,
           const Eigen::Matrix<double, rows, rows>& covariance) {
    const Eigen::Matrix<double, size, rows> weighted =
        covariance.llt().solve(H).transpose();  // Hᵀ R⁻¹
    information_ = Symmetric<size>(information_ + weighted * H);
    vector_ += weighted * residual;
  }

  // The errors that are most likely after what was added; from then on errors are counted from
  // there.
  Vector Correct() {
    const Vector step = information_.llt().solve(vector_);
    vector_.setZero();
    return step;
  }

 private:
  template <int n>
  static Eigen::Matrix<double, n, n> Symmetric(const Eigen::Matrix<double, n, n>& matrix) {
    return 0.5 * (matrix + matrix.transpose());
  }
  static Matrix Inverse(const Matrix& matrix) {
    return Symmetric<size>(matrix.llt().solve(Matrix::Identity()));
  }

  Matrix information_;
  Vector vector_ = Vector::Zero();
};

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_INFORMATION_FORM_H_
