// Sparse symmetric positive definite systems whose entries are square blocks of one size, one row
// of blocks a pose. The same input gives the same bytes: one thread, no BLAS.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_BLOCK_CHOLESKY_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_BLOCK_CHOLESKY_H_

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace strata {

// Where the block of rows `i` and columns `j` of a symmetric matrix is kept: as it is, or, being
// kept as the block (j, i), transposed.
struct BlockSlot {
  std::size_t offset = 0;  // into the values
  bool transposed = false;
};

// A multifrontal supernodal Cholesky factorisation (Liu 1992) in an approximate minimum degree
// ordering of the blocks. Made once for a pattern, factored for many values. Not thread-safe.
class BlockCholesky {
 public:
  // A matrix of `rows` × `rows` blocks of size `block_size` with every diagonal block and the
  // blocks `off_diagonal` (either triangle, repetitions allowed) not zero. REQUIRES: indices below
  // `rows`, none of them a diagonal block.
  BlockCholesky(int block_size,
                std::size_t rows,
                const std::vector<std::pair<std::size_t, std::size_t>>& off_diagonal);

  // Values are blocks column by column. Only slots that exist: the diagonal and the pattern.
  BlockSlot Slot(std::size_t i, std::size_t j) const;
  std::vector<double>& values() { return values_; }
  const std::vector<double>& values() const { return values_; }
  Eigen::VectorXd Diagonal() const;  // by original rows

  // Factors the values with `damping` (by original rows) added to the diagonal. False if that is
  // not positive definite.
  bool Factor(const Eigen::VectorXd& damping);
  // The solution for `b`, by original rows. REQUIRES: the last Factor() succeeded.
  Eigen::VectorXd Solve(const Eigen::VectorXd& b) const;

  std::size_t factor_blocks() const;  // of the factor: what memory and time go by

 private:
  // Consecutive columns (in elimination order) with the same rows below them.
  struct Supernode {
    std::size_t begin = 0, end = 0;
    std::vector<std::size_t> below;  // ascending
    std::vector<std::size_t> children;
    Eigen::MatrixXd factor;  // (columns + below) × columns, lower
    // Where the below × below numbers for the parent are made and, when the children's are used up,
    // kept on the stack.
    std::size_t made = 0, kept = 0;
  };

  void Order(const std::vector<std::vector<std::size_t>>& neighbours);
  std::vector<std::vector<std::size_t>> ColumnStructures() const;
  void MakeSupernodes(std::vector<std::vector<std::size_t>> structures);
  void AssembleValues(const Eigen::VectorXd& damping, Supernode& node);
  void PlaceUpdates();
  Eigen::Map<Eigen::MatrixXd> UpdateAt(const Supernode& node, std::size_t place);
  void AssembleChild(const Supernode& child, Supernode& node);
  bool Eliminate(Supernode& node);
  void KeepUpdate(const Supernode& node);

  int block_size_;
  std::vector<std::size_t> position_;  // in the elimination order, of each row
  std::vector<std::size_t> row_;       // its inverse
  // Values by columns of the lower triangle in elimination order: rows_[k] for k in
  // [begin_[c], begin_[c + 1]), the diagonal first, then ascending.
  std::vector<std::size_t> begin_, rows_;
  std::vector<double> values_;
  std::vector<Supernode> supernodes_;
  std::vector<std::size_t> supernode_of_;  // by column
  std::vector<double> stack_;              // scratch: updates
  std::vector<std::size_t> local_;         // scratch: row of the front at hand
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_BLOCK_CHOLESKY_H_
