// Where beams go through: what is open of a floor, cell by cell.
#ifndef STRATA_CORE_CLASSIFICATION_PLACES_FREE_SPACE_H_
#define STRATA_CORE_CLASSIFICATION_PLACES_FREE_SPACE_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace strata {

// Columns along x, rows along y. What is outside is not open.
class FreeSpace {
 public:
  // Nothing is open yet. `min_m`: the lower left corner. REQUIRES: cell_m > 0, columns and rows ≥ 0
  // and few enough that their product is an int.
  FreeSpace(const Eigen::Vector2d& min_m, double cell_m, int columns, int rows);

  std::size_t Index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  std::uint8_t& At(std::size_t index) { return open_[index]; }
  bool IsOpen(int column, int row) const {
    return column >= 0 && column < columns_ && row >= 0 && row < rows_ &&
           open_[Index(column, row)] != 0;
  }
  bool IsOpen(const Eigen::Vector2d& p) const;
  // How far it is open from there along `angle_rad`, by steps of half a cell, `most_m` at most [m].
  double Cast(const Eigen::Vector2d& from, double angle_rad, double most_m) const;

  const Eigen::Vector2d& min_m() const { return min_m_; }
  double cell_m() const { return cell_m_; }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  const std::vector<std::uint8_t>& cells() const { return open_; }  // by rows

 private:
  Eigen::Vector2d min_m_;
  double cell_m_;
  int columns_, rows_;
  std::vector<std::uint8_t> open_;
};

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_PLACES_FREE_SPACE_H_
