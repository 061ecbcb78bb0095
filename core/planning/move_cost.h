// What moves cost, in whole numbers.
#ifndef STRATA_CORE_PLANNING_MOVE_COST_H_
#define STRATA_CORE_PLANNING_MOVE_COST_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace strata {

// A move of one cell over level ground without danger costs kCostPerCell.
inline constexpr std::uint32_t kCostPerCell = 2048;
inline constexpr std::uint32_t kCostPerDiagonal = 2896;  // ⌊2048 √2⌋

// Below what a search may add to the largest cost it goes on from.
inline constexpr std::uint32_t kDearestMove = 0x0FFFFFFF;

// Comes on top of the danger over unobserved ground.
inline constexpr double kGapDanger = 1.0;

// Heights are mostly whole steps of this, as tiles have them [1/m].
inline constexpr float kHeightStepsPerM = 512.0F;

// Cost of a move of `run_m` sideways and `rise_m` up or down between patches of two dangers, whose
// mean is `danger`.
inline std::uint32_t MoveCost(double run_m, double rise_m, double danger, double cell_size_m) {
  const double length_cells = std::sqrt(run_m * run_m + rise_m * rise_m) / cell_size_m;
  const double cost = kCostPerCell * length_cells * (1.0 + danger);
  // To nearest, and never below what the search's heuristic takes for the same stretch.
  return static_cast<std::uint32_t>(std::min(cost + 0.5, static_cast<double>(kDearestMove)));
}

// The same for one size of cells; of most moves to neighbouring cells, where the rise is a whole
// number of steps, without a root.
class StepCosts {
 public:
  // For rises of up to max_rise_m.
  StepCosts(double cell_size_m, float max_rise_m) : cell_size_m_(cell_size_m) {
    const auto count = static_cast<std::size_t>(max_rise_m * kHeightStepsPerM) + 2;
    for (int k = 0; k < 2; ++k) {
      for (std::size_t steps = 0; steps < count; ++steps) {
        const double rise = static_cast<double>(steps) / kHeightStepsPerM;
        const double run = Run(k);
        lengths_[k].push_back(kCostPerCell * (std::sqrt(run * run + rise * rise) / cell_size_m));
      }
    }
  }

  // `dangers` is the sum of 1 + danger of both ends.
  std::uint32_t OfSteps(int direction, std::uint32_t rise_steps, double dangers) const {
    if (rise_steps >= lengths_[0].size()) {
      return OfRise(direction, 1, rise_steps / double{kHeightStepsPerM}, dangers);
    }
    return static_cast<std::uint32_t>(lengths_[direction & 1][rise_steps] * (0.5 * dangers) + 0.5);
  }
  // The cost of any move, over `cells` cells.
  [[gnu::noinline]] std::uint32_t OfRise(int direction,
                                         int cells,
                                         double rise_m,
                                         double dangers) const {
    const double danger = 0.5 * dangers - 1.0 + kGapDanger * (cells - 1) / cells;
    return MoveCost(cells * Run(direction), rise_m, danger, cell_size_m_);
  }

 private:
  double Run(int direction) const {
    return (direction & 1) != 0 ? cell_size_m_ * 1.4142135623730951 : cell_size_m_;
  }

  double cell_size_m_;
  std::array<std::vector<double>, 2> lengths_;  // along an axis, along a diagonal
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_MOVE_COST_H_
