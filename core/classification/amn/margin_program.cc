#include "core/classification/amn/margin_program.h"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace strata {
namespace {

// Far beyond what any of our problems took; the gap then says how far it came.
constexpr int kMaxSteps = 1'000'000;

// Where the derivative p − q s − Σ_e d_e max(0, u_e + s d_e) becomes zero, in [0, most].
double BestStep(
    double p, double q, const Eigen::VectorXd& u, const Eigen::VectorXd& d, double most) {
  std::vector<double> breaks = {0.0, most};
  for (Eigen::Index e = 0; e < u.size(); ++e) {
    const double at = d[e] == 0.0 ? -1.0 : -u[e] / d[e];
    if (at > 0.0 && at < most) breaks.push_back(at);
  }
  std::sort(breaks.begin(), breaks.end());
  for (std::size_t k = 0; k + 1 < breaks.size(); ++k) {
    const double middle = 0.5 * (breaks[k] + breaks[k + 1]);
    double value = p;
    double slope = q;
    for (Eigen::Index e = 0; e < u.size(); ++e) {
      if (u[e] + middle * d[e] <= 0.0) continue;
      value -= d[e] * u[e];
      slope += d[e] * d[e];
    }
    // Within this stretch the derivative is value − slope · s.
    if (value - slope * breaks[k + 1] <= 0.0) {
      return slope > 0.0 ? std::clamp(value / slope, breaks[k], breaks[k + 1]) : breaks[k];
    }
  }
  return most;
}

}  // namespace

MarginProgram::MarginProgram(Eigen::Index size, Eigen::Index non_negative, double c)
    : non_negative_(non_negative),
      c_(c),
      slack_(c),
      sum_(Eigen::VectorXd::Zero(size)),
      w_(Eigen::VectorXd::Zero(size)) {}

void MarginProgram::AddPlane(const Eigen::VectorXd& a, double b) {
  a_.push_back(a);
  b_.push_back(b);
  beta_.push_back(0.0);
}

void MarginProgram::Update() {
  w_ = sum_;
  w_.tail(non_negative_) = w_.tail(non_negative_).cwiseMax(0.0);
}

void MarginProgram::Step(Eigen::Index i, Eigen::Index j) {
  Eigen::VectorXd d = Eigen::VectorXd::Zero(sum_.size());
  double db = 0.0;
  double room = slack_;
  if (i >= 0) {
    d += a_[static_cast<std::size_t>(i)];
    db += b_[static_cast<std::size_t>(i)];
  }
  if (j >= 0) {
    d -= a_[static_cast<std::size_t>(j)];
    db -= b_[static_cast<std::size_t>(j)];
    room = beta_[static_cast<std::size_t>(j)];
  }
  const Eigen::Index free = sum_.size() - non_negative_;
  const double step = BestStep(db - w_.head(free).dot(d.head(free)),
                               d.head(free).squaredNorm(),
                               sum_.tail(non_negative_),
                               d.tail(non_negative_),
                               room);
  // All of it, so that nothing is left by rounding.
  const double left = step >= room ? 0.0 : room - step;
  (j >= 0 ? beta_[static_cast<std::size_t>(j)] : slack_) = left;
  (i >= 0 ? beta_[static_cast<std::size_t>(i)] : slack_) += step;
  sum_ += step * d;
  Update();
}

void MarginProgram::Solve(double tolerance) {
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Index up = -1;
    Eigen::Index down = -1;
    double most = 0.0;
    double least = slack_ > 0.0 ? 0.0 : std::numeric_limits<double>::infinity();
    double linear = 0.0;
    for (std::size_t t = 0; t < a_.size(); ++t) {
      const double gradient = b_[t] - w_.dot(a_[t]);
      linear += beta_[t] * b_[t];
      if (gradient > most) {
        most = gradient;
        up = static_cast<Eigen::Index>(t);
      }
      if (beta_[t] > 0.0 && gradient < least) {
        least = gradient;
        down = static_cast<Eigen::Index>(t);
      }
    }
    const double norm = 0.5 * w_.squaredNorm();
    dual_ = linear - norm;
    primal_ = norm + c_ * most;
    if (primal_ - dual_ <= tolerance || up == down) return;
    Step(up, down);
  }
}

}  // namespace strata
