#include "core/posegraph/alignment/odometry_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/geometry/pose.h"

namespace strata {
namespace {

constexpr int kBlock = 10;
constexpr std::size_t kLeastSteps = 30;
// Nobody's odometry is better.
constexpr double kLeastSigmaRad = 1e-4;
constexpr double kLeastSigmaM = 1e-3;

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

}  // namespace

std::optional<OdometryNoise> EstimateOdometryNoise(std::span<const std::optional<Pose>> errors) {
  Squares turns;
  Squares moves;
  for (const std::optional<Pose>& error : errors) {
    if (!error.has_value()) {
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
