#include "core/posegraph/alignment/odometry_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/geometry/pose.h"

namespace strata {
namespace {

constexpr int kBlock = 10;
constexpr std::size_t kLeastSteps = 30;
// Nobody's odometry is better.
constexpr double kLeastSigmaRad = 1e-4;
constexpr double kLeastSigmaM = 1e-3;
// Ordinary are nine of ten steps; 0.9 of χ² with three degrees of freedom is below this.
constexpr double kOrdinary = 0.9;
constexpr double kOrdinaryChi2 = 6.25;
constexpr double kJumpSigmas = 6.0;
constexpr double kLeastJumpM = 0.3;
constexpr double kLeastJumpRad = 0.05;

// Mean squares of errors and of their sums over blocks of steps, per step and axis.
class Squares {
 public:
  void Add(const Eigen::Vector3d& error) {
    single_ += error.squaredNorm();
    ++steps_;
    sum_ += error;
    if (++in_block_ < kBlock) return;
    blocks_sum_ += sum_.squaredNorm() / kBlock;
    ++blocks_;
    EndBlock();
  }
  void EndBlock() {
    sum_.setZero();
    in_block_ = 0;
  }
  std::size_t steps() const { return steps_; }
  double Sigma() const {
    const double single = single_ / (3.0 * static_cast<double>(steps_));
    const double block = blocks_ > 0 ? blocks_sum_ / (3.0 * blocks_) : 0.0;
    return std::sqrt(std::max(single, block));
  }

 private:
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
  int in_block_ = 0;
  double single_ = 0.0;
  std::size_t steps_ = 0;
  double blocks_sum_ = 0.0;
  int blocks_ = 0;
};

// Of one axis, of the nine tenths of steps with the least errors, whose squares these are.
double OrdinarySigma(std::vector<double> squares) {
  const auto ordinary = squares.begin() + static_cast<std::ptrdiff_t>(
                                              kOrdinary * static_cast<double>(squares.size() - 1));
  std::ranges::nth_element(squares, ordinary);
  return std::sqrt(*ordinary / kOrdinaryChi2);
}

OdometryNoise OrdinaryNoise(std::span<const std::optional<Pose>> errors) {
  std::vector<double> turns;
  std::vector<double> moves;
  for (const std::optional<Pose>& error : errors) {
    if (!error.has_value()) continue;
    turns.push_back(So3Log(error->linear()).squaredNorm());
    moves.push_back(error->translation().squaredNorm());
  }
  if (turns.empty()) return {};
  return {OrdinarySigma(std::move(turns)), OrdinarySigma(std::move(moves))};
}

}  // namespace

bool IsJump(const Pose& error, const OdometryNoise& noise) {
  return error.translation().norm() > std::max(kLeastJumpM, kJumpSigmas * noise.sigma_m) ||
         RotationAngleRad(error) > std::max(kLeastJumpRad, kJumpSigmas * noise.sigma_rad);
}

std::optional<OdometryNoise> EstimateOdometryNoise(std::span<const std::optional<Pose>> errors) {
  const OdometryNoise ordinary = OrdinaryNoise(errors);
  Squares turns;
  Squares moves;
  for (const std::optional<Pose>& error : errors) {
    if (!error.has_value() || IsJump(*error, ordinary)) {
      turns.EndBlock();
      moves.EndBlock();
      continue;
    }
    turns.Add(So3Log(error->linear()));
    moves.Add(error->translation());
  }
  if (turns.steps() < kLeastSteps) return std::nullopt;
  return OdometryNoise{std::max(kLeastSigmaRad, turns.Sigma()),
                       std::max(kLeastSigmaM, moves.Sigma())};
}

}  // namespace strata
