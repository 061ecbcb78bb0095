#include "core/storage/postgresql/cells.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <Eigen/Geometry>

namespace strata {
namespace {

constexpr double kCellSizeM = 64.0;
constexpr double kFarthest = 1e15;  // exact in doubles, and far from the ends of the integers
// A side of 1 km; laser scans have 3 to 5 cells a side.
constexpr std::int64_t kMostCellsASide = 16;

std::int64_t CellOf(double metres) {
  return static_cast<std::int64_t>(
      std::clamp(std::floor(metres / kCellSizeM), -kFarthest, kFarthest));
}

}  // namespace

CellRange CellsOf(const Eigen::AlignedBox2d& box) {
  return {
      CellOf(box.min().x()), CellOf(box.max().x()), CellOf(box.min().y()), CellOf(box.max().y())};
}

bool IsWide(const CellRange& cells) {
  return cells.x_max - cells.x_min >= kMostCellsASide ||
         cells.y_max - cells.y_min >= kMostCellsASide;
}

}  // namespace strata
