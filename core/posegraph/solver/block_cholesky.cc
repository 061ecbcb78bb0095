#include "core/posegraph/solver/block_cholesky.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace strata {
namespace {

using Indices = std::vector<std::size_t>;
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

// Columns are joined although some of their blocks are zero while the front is small or the zeros
// are few: dense arithmetic on them costs less than another front.
constexpr std::size_t kSmallFrontColumns = 2;
constexpr double kMaxZeroShare = 0.1;

Eigen::Index ToIndex(std::size_t i) { return static_cast<Eigen::Index>(i); }

// The order in which minimum degree eliminates the rows.
Indices MinimumDegree(const std::vector<Indices>& neighbours) {
  std::vector<Eigen::Triplet<double, int>> entries;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    entries.emplace_back(static_cast<int>(i), static_cast<int>(i), 1.0);
    for (const std::size_t j : neighbours[i]) {
      entries.emplace_back(static_cast<int>(i), static_cast<int>(j), 1.0);
    }
  }
  const int n = static_cast<int>(neighbours.size());
  Eigen::SparseMatrix<double, Eigen::ColMajor, int> pattern(n, n);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(pattern, order);
  Indices rows(neighbours.size());
  for (int k = 0; k < n; ++k)
    rows[static_cast<std::size_t>(k)] = static_cast<std::size_t>(order.indices()[k]);
  return rows;
}

// The parent of each column in the elimination tree (Liu 1990), kNone for a root.
Indices EliminationTree(const std::vector<Indices>& neighbours,
                        const Indices& row,
                        const Indices& position) {
  Indices parent(row.size(), kNone);
  Indices ancestor(row.size(), kNone);
  for (std::size_t j = 0; j < row.size(); ++j) {
    for (const std::size_t neighbour : neighbours[row[j]]) {
      std::size_t k = position[neighbour];
      while (k < j) {  // also ends at kNone
        const std::size_t next = ancestor[k];
        ancestor[k] = j;
        if (next == kNone) parent[k] = j;
        k = next;
      }
    }
  }
  return parent;
}

// Columns so that every subtree is consecutive, children before parents.
Indices PostOrder(const Indices& parent) {
  std::vector<Indices> children(parent.size());
  Indices stack;
  for (std::size_t k = parent.size(); k-- > 0;) {
    (parent[k] == kNone ? stack : children[parent[k]]).push_back(k);
  }
  Indices order;
  while (!stack.empty()) {
    const std::size_t k = stack.back();
    if (children[k].empty()) {
      stack.pop_back();
      order.push_back(k);
    } else {
      const std::size_t child = children[k].back();
      children[k].pop_back();  // `k` is met again when all of its children are done
      stack.push_back(child);
    }
  }
  return order;
}

}  // namespace

BlockCholesky::BlockCholesky(int block_size,
                             std::size_t rows,
                             const std::vector<std::pair<std::size_t, std::size_t>>& off_diagonal)
    : block_size_(block_size), position_(rows), local_(rows) {
  std::vector<Indices> neighbours(rows);
  for (const auto& [i, j] : off_diagonal) {
    neighbours[i].push_back(j);
    neighbours[j].push_back(i);
  }
  for (Indices& list : neighbours) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  Order(neighbours);
  begin_.push_back(0);
  for (std::size_t c = 0; c < rows; ++c) {
    rows_.push_back(c);
    for (const std::size_t neighbour : neighbours[row_[c]]) {
      if (position_[neighbour] > c) rows_.push_back(position_[neighbour]);
    }
    std::sort(rows_.begin() + static_cast<std::ptrdiff_t>(begin_.back()), rows_.end());
    begin_.push_back(rows_.size());
  }
  values_.assign(rows_.size() * static_cast<std::size_t>(block_size * block_size), 0.0);
  MakeSupernodes(ColumnStructures());
}

void BlockCholesky::Order(const std::vector<Indices>& neighbours) {
  const auto set_positions = [this] {
    for (std::size_t k = 0; k < row_.size(); ++k) position_[row_[k]] = k;
  };
  row_ = MinimumDegree(neighbours);
  set_positions();
  Indices ordered;
  for (const std::size_t k : PostOrder(EliminationTree(neighbours, row_, position_))) {
    ordered.push_back(row_[k]);
  }
  row_ = std::move(ordered);
  set_positions();
}

// The rows below the diagonal that are not zero in each column of the factor: those of the matrix
// and those of the columns whose first such row this column is.
std::vector<Indices> BlockCholesky::ColumnStructures() const {
  std::vector<Indices> structures(row_.size());
  std::vector<Indices> children(row_.size());
  Indices merged;
  for (std::size_t c = 0; c < row_.size(); ++c) {
    Indices& structure = structures[c];
    structure.assign(rows_.begin() + static_cast<std::ptrdiff_t>(begin_[c] + 1),
                     rows_.begin() + static_cast<std::ptrdiff_t>(begin_[c + 1]));
    for (const std::size_t child : children[c]) {
      const Indices& other = structures[child];
      merged.clear();
      std::set_union(structure.begin(),
                     structure.end(),
                     other.begin() + 1,
                     other.end(),
                     std::back_inserter(merged));
      structure.swap(merged);
    }
    if (!structure.empty()) children[structure.front()].push_back(c);
  }
  return structures;
}

void BlockCholesky::MakeSupernodes(std::vector<Indices> structures) {
  supernode_of_.resize(row_.size());
  for (std::size_t begin = 0; begin < row_.size();) {
    std::size_t end = begin + 1;
    std::size_t zeros = 0;
    for (; end < row_.size(); ++end) {
      const Indices& last = structures[end - 1];
      if (last.empty() || last.front() != end) break;  // only a child may join its parent
      const std::size_t columns = end - begin;
      const std::size_t more = columns * (structures[end].size() + 1 - last.size());
      const std::size_t blocks =
          (columns + 1) * (columns + 2) / 2 + (columns + 1) * structures[end].size();
      const bool join =
          more == 0 || columns < kSmallFrontColumns ||
          static_cast<double>(zeros + more) < kMaxZeroShare * static_cast<double>(blocks);
      if (!join) break;
      zeros += more;
    }
    Supernode node;
    node.begin = begin;
    node.end = end;
    node.below = std::move(structures[end - 1]);
    const std::size_t columns = end - begin;
    const Eigen::Index size = ToIndex(columns) * block_size_;
    node.factor.resize(size + ToIndex(node.below.size()) * block_size_, size);
    for (std::size_t c = begin; c < end; ++c) supernode_of_[c] = supernodes_.size();
    supernodes_.push_back(std::move(node));
    begin = end;
  }
  for (std::size_t s = 0; s < supernodes_.size(); ++s) {
    if (supernodes_[s].below.empty()) continue;
    supernodes_[supernode_of_[supernodes_[s].below.front()]].children.push_back(s);
  }
  PlaceUpdates();
}

// In postorder the children's updates are the uppermost on the stack.
void BlockCholesky::PlaceUpdates() {
  std::size_t top = 0;
  std::size_t size = 0;
  for (Supernode& node : supernodes_) {
    const std::size_t rows = node.below.size() * static_cast<std::size_t>(block_size_);
    node.made = top;
    node.kept = node.children.empty() ? top : supernodes_[node.children.front()].kept;
    size = std::max(size, node.made + rows * rows);
    top = node.kept + rows * rows;
  }
  stack_.resize(size);
}

Eigen::Map<Eigen::MatrixXd> BlockCholesky::UpdateAt(const Supernode& node, std::size_t place) {
  const Eigen::Index rows = ToIndex(node.below.size()) * block_size_;
  return {stack_.data() + place, rows, rows};
}

BlockSlot BlockCholesky::Slot(std::size_t i, std::size_t j) const {
  BlockSlot slot;
  std::size_t row = position_[i];
  std::size_t column = position_[j];
  if (row < column) {
    std::swap(row, column);
    slot.transposed = true;
  }
  const auto first = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[column]);
  const auto last = rows_.begin() + static_cast<std::ptrdiff_t>(begin_[column + 1]);
  const auto found = std::lower_bound(first, last, row);
  slot.offset = static_cast<std::size_t>(found - rows_.begin()) *
                static_cast<std::size_t>(block_size_ * block_size_);
  return slot;
}

Eigen::VectorXd BlockCholesky::Diagonal() const {
  Eigen::VectorXd diagonal(ToIndex(row_.size()) * block_size_);
  for (std::size_t i = 0; i < row_.size(); ++i) {
    const double* block = values_.data() + Slot(i, i).offset;
    for (int k = 0; k < block_size_; ++k) {
      diagonal[ToIndex(i) * block_size_ + k] = block[k * (block_size_ + 1)];
    }
  }
  return diagonal;
}

void BlockCholesky::AssembleValues(const Eigen::VectorXd& damping, Supernode& node) {
  const Eigen::Index size = block_size_;
  const std::size_t entries = static_cast<std::size_t>(block_size_ * block_size_);
  for (std::size_t c = node.begin; c < node.end; ++c) {
    const Eigen::Index column = ToIndex(c - node.begin) * size;
    for (std::size_t k = begin_[c]; k < begin_[c + 1]; ++k) {
      const Eigen::Map<const Eigen::MatrixXd> block(values_.data() + k * entries, size, size);
      node.factor.block(ToIndex(local_[rows_[k]]) * size, column, size, size) += block;
    }
    node.factor.diagonal().segment(column, size) += damping.segment(ToIndex(row_[c]) * size, size);
  }
}

void BlockCholesky::AssembleChild(const Supernode& child, Supernode& node) {
  const Eigen::Index size = block_size_;
  const std::size_t columns = node.end - node.begin;
  const Eigen::Map<Eigen::MatrixXd> from = UpdateAt(child, child.kept);
  Eigen::Map<Eigen::MatrixXd> update = UpdateAt(node, node.made);
  for (std::size_t b = 0; b < child.below.size(); ++b) {
    const std::size_t column = local_[child.below[b]];
    for (std::size_t a = b; a < child.below.size(); ++a) {
      const std::size_t row = local_[child.below[a]];
      const auto block = from.block(ToIndex(a) * size, ToIndex(b) * size, size, size);
      if (column < columns) {
        node.factor.block(ToIndex(row) * size, ToIndex(column) * size, size, size) += block;
      } else {
        update.block(ToIndex(row - columns) * size, ToIndex(column - columns) * size, size, size) +=
            block;
      }
    }
  }
}

// The front's own columns of the factor, and what they leave for the rows below.
bool BlockCholesky::Eliminate(Supernode& node) {
  auto diagonal = node.factor.topRows(node.factor.cols());
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(diagonal);
  if (llt.info() != Eigen::Success) return false;
  if (node.below.empty()) return true;
  auto rest = node.factor.bottomRows(ToIndex(node.below.size()) * block_size_);
  diagonal.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(rest);
  Eigen::Map<Eigen::MatrixXd> update = UpdateAt(node, node.made);
  update.selfadjointView<Eigen::Lower>().rankUpdate(rest, -1.0);
  if (node.kept != node.made) KeepUpdate(node);
  return true;
}

// Down to where the children's updates began; only what is below the diagonal is ever read.
void BlockCholesky::KeepUpdate(const Supernode& node) {
  const std::size_t rows = node.below.size() * static_cast<std::size_t>(block_size_);
  for (std::size_t j = 0; j < rows; ++j) {
    const auto from = stack_.begin() + static_cast<std::ptrdiff_t>(node.made + j * rows);
    const auto to = stack_.begin() + static_cast<std::ptrdiff_t>(node.kept + j * rows);
    std::copy(from + static_cast<std::ptrdiff_t>(j),
              from + static_cast<std::ptrdiff_t>(rows),
              to + static_cast<std::ptrdiff_t>(j));
  }
}

bool BlockCholesky::Factor(const Eigen::VectorXd& damping) {
  for (Supernode& node : supernodes_) {
    const std::size_t columns = node.end - node.begin;
    for (std::size_t c = 0; c < columns; ++c) local_[node.begin + c] = c;
    for (std::size_t k = 0; k < node.below.size(); ++k) local_[node.below[k]] = columns + k;
    node.factor.setZero();
    UpdateAt(node, node.made).triangularView<Eigen::Lower>().setZero();
    AssembleValues(damping, node);
    for (const std::size_t c : node.children) AssembleChild(supernodes_[c], node);
    if (!Eliminate(node)) return false;
  }
  return true;
}

Eigen::VectorXd BlockCholesky::Solve(const Eigen::VectorXd& b) const {
  const Eigen::Index size = block_size_;
  Eigen::VectorXd x(b.size());
  for (std::size_t k = 0; k < row_.size(); ++k) {
    x.segment(ToIndex(k) * size, size) = b.segment(ToIndex(row_[k]) * size, size);
  }
  Eigen::VectorXd rest;
  for (const Supernode& node : supernodes_) {
    const Eigen::Index columns = node.factor.cols();
    const Eigen::Index below = node.factor.rows() - columns;
    auto own = x.segment(ToIndex(node.begin) * size, columns);
    node.factor.topRows(columns).triangularView<Eigen::Lower>().solveInPlace(own);
    rest.noalias() = node.factor.bottomRows(below) * own;
    for (std::size_t k = 0; k < node.below.size(); ++k) {
      x.segment(ToIndex(node.below[k]) * size, size) -= rest.segment(ToIndex(k) * size, size);
    }
  }
  for (auto node = supernodes_.rbegin(); node != supernodes_.rend(); ++node) {
    const Eigen::Index columns = node->factor.cols();
    const Eigen::Index below = node->factor.rows() - columns;
    rest.resize(below);
    for (std::size_t k = 0; k < node->below.size(); ++k) {
      rest.segment(ToIndex(k) * size, size) = x.segment(ToIndex(node->below[k]) * size, size);
    }
    auto own = x.segment(ToIndex(node->begin) * size, columns);
    own.noalias() -= node->factor.bottomRows(below).transpose() * rest;
    node->factor.topRows(columns).triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
  Eigen::VectorXd result(b.size());
  for (std::size_t k = 0; k < row_.size(); ++k) {
    result.segment(ToIndex(row_[k]) * size, size) = x.segment(ToIndex(k) * size, size);
  }
  return result;
}

std::size_t BlockCholesky::factor_blocks() const {
  std::size_t blocks = 0;
  for (const Supernode& node : supernodes_) {
    const std::size_t columns = node.end - node.begin;
    blocks += columns * (columns + 1) / 2 + columns * node.below.size();
  }
  return blocks;
}

}  // namespace strata
