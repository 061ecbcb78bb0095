#include "core/classification/reduction.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

#include "core/common/option_checks.h"
#include "core/common/random.h"
#include "core/common/status.h"

namespace strata {
namespace {

class Reducer {
 public:
  Reducer(std::span<const Eigen::Vector3f> positions,
          const LabelledFeatures& data,
          const ReductionOptions& options)
      : positions_(positions), data_(data), options_(options) {
    reduced_.data.classes = data.classes;
    order_.resize(data.size());
    std::iota(order_.begin(), order_.end(), 0U);
  }

  ReducedPoints Run() {
    std::vector<std::span<std::uint32_t>> leaves;
    if (options_.kind == ReductionKind::kRandom) {
      SplitMix64 random(options_.seed);
      order_ = SampleIndices(static_cast<std::uint32_t>(order_.size()), options_.count, random);
      std::sort(order_.begin(), order_.end());
    }
    if (options_.kind == ReductionKind::kBalanced) order_ = DrawBalanced();
    if (options_.kind == ReductionKind::kDepth || options_.kind == ReductionKind::kPure) {
      reduced_.row_of.resize(order_.size());
      if (!order_.empty()) Split(order_, 0, leaves);
    } else {
      for (std::uint32_t& row : order_) leaves.emplace_back(&row, 1);
    }
    reduced_.data.features.resize(static_cast<Eigen::Index>(leaves.size()), data_.features.cols());
    for (const std::span<std::uint32_t> leaf : leaves) Merge(leaf);
    return std::move(reduced_);
  }

 private:
  std::vector<std::uint32_t> DrawBalanced() const {
    std::vector<std::vector<std::uint32_t>> of_class(data_.classes);
    for (const std::uint32_t row : order_) of_class[data_.labels[row]].push_back(row);
    double roots = 0.0;
    for (const auto& rows : of_class) roots += std::sqrt(static_cast<double>(rows.size()));
    SplitMix64 random(options_.seed);
    std::vector<std::uint32_t> drawn;
    for (const auto& rows : of_class) {
      const auto size = static_cast<std::uint32_t>(rows.size());
      const double share = std::sqrt(static_cast<double>(size)) / roots;
      const auto count = static_cast<std::uint32_t>(std::ceil(share * options_.count));
      for (const std::uint32_t k : SampleIndices(size, count, random)) drawn.push_back(rows[k]);
    }
    std::sort(drawn.begin(), drawn.end());
    return drawn;
  }

  bool IsLeaf(std::span<const std::uint32_t> rows, int depth) const {
    if (rows.size() < 2) return true;
    if (options_.kind == ReductionKind::kDepth) return depth + 1 >= options_.depth;
    return std::all_of(rows.begin(), rows.end(), [&](std::uint32_t row) {
      return data_.labels[row] == data_.labels[rows.front()];
    });
  }

  // How many of the rows, brought to the front, lie in the lower part of their box.
  std::size_t Halve(std::span<std::uint32_t> rows) const {
    Eigen::Vector3f low = positions_[rows.front()];
    Eigen::Vector3f high = low;
    for (const std::uint32_t row : rows) {
      low = low.cwiseMin(positions_[row]);
      high = high.cwiseMax(positions_[row]);
    }
    Eigen::Index axis = 0;
    (high - low).maxCoeff(&axis);
    if (options_.kind == ReductionKind::kDepth) {
      const float middle = low[axis] + (high[axis] - low[axis]) / 2.0F;
      const auto upper = std::partition(rows.begin(), rows.end(), [&](std::uint32_t row) {
        return positions_[row][axis] <= middle;
      });
      return static_cast<std::size_t>(upper - rows.begin());
    }
    const auto middle = rows.begin() + static_cast<std::ptrdiff_t>(rows.size() / 2);
    std::nth_element(rows.begin(), middle, rows.end(), [&](std::uint32_t a, std::uint32_t b) {
      const float x = positions_[a][axis];
      const float y = positions_[b][axis];
      return x != y ? x < y : a < b;
    });
    return rows.size() / 2;
  }

  void Split(std::span<std::uint32_t> rows,
             int depth,
             std::vector<std::span<std::uint32_t>>& leaves) {
    const std::size_t lower = IsLeaf(rows, depth) ? rows.size() : Halve(rows);
    if (lower == rows.size()) {  // also where all are at one place
      leaves.push_back(rows);
      return;
    }
    Split(rows.first(lower), depth + 1, leaves);
    Split(rows.subspan(lower), depth + 1, leaves);
  }

  ClassIndex CommonestLabel(std::span<const std::uint32_t> rows) const {
    std::vector<std::size_t> count(data_.classes, 0);
    for (const std::uint32_t row : rows) ++count[data_.labels[row]];
    return static_cast<ClassIndex>(std::max_element(count.begin(), count.end()) - count.begin());
  }

  std::uint32_t NearestTo(const Eigen::Vector3f& place, std::span<const std::uint32_t> rows) const {
    return *std::min_element(rows.begin(), rows.end(), [&](std::uint32_t a, std::uint32_t b) {
      return (positions_[a] - place).squaredNorm() < (positions_[b] - place).squaredNorm();
    });
  }

  void Merge(std::span<std::uint32_t> rows) {
    std::sort(rows.begin(), rows.end());  // sums and ties do not depend on how the tree was cut
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const std::uint32_t row : rows) sum += positions_[row].cast<double>();
    const Eigen::Vector3f mean = (sum / static_cast<double>(rows.size())).cast<float>();
    const auto at = static_cast<Eigen::Index>(reduced_.positions.size());
    reduced_.data.features.row(at) = data_.features.row(NearestTo(mean, rows));
    reduced_.positions.push_back(mean);
    reduced_.data.labels.push_back(CommonestLabel(rows));
    reduced_.counts.push_back(static_cast<std::uint32_t>(rows.size()));
    if (reduced_.row_of.empty()) return;
    for (const std::uint32_t row : rows) reduced_.row_of[row] = static_cast<std::uint32_t>(at);
  }

  const std::span<const Eigen::Vector3f> positions_;
  const LabelledFeatures& data_;
  const ReductionOptions& options_;
  std::vector<std::uint32_t> order_;
  ReducedPoints reduced_;
};

}  // namespace

absl::Status ReductionOptions::Validate() const {
  OptionChecks checks("reduction options");
  checks.InRange("depth", depth, 1, 30);
  checks.InRange("count", count, 1, std::numeric_limits<std::uint32_t>::max());
  return checks.status();
}

ReducedPoints Reduce(std::span<const Eigen::Vector3f> positions,
                     const LabelledFeatures& data,
                     const ReductionOptions& options) {
  return Reducer(positions, data, options).Run();
}

absl::StatusOr<ReductionOptions> ParseReduction(absl::string_view text) {
  ReductionOptions options;
  const std::pair<absl::string_view, absl::string_view> parts =
      absl::StrSplit(text, absl::MaxSplits('=', 1));
  const auto [kind, number] = parts;
  if (text == "auto") {
    options.kind = ReductionKind::kBalanced;
  } else if (text == "pure") {
    options.kind = ReductionKind::kPure;
  } else if (text == "none") {
    options.kind = ReductionKind::kNone;
  } else if (kind == "depth" && absl::SimpleAtoi(number, &options.depth)) {
    options.kind = ReductionKind::kDepth;
  } else if (kind == "random" && absl::SimpleAtoi(number, &options.count)) {
    options.kind = ReductionKind::kRandom;
  } else {
    return absl::InvalidArgumentError(absl::StrCat(
        "reduction '", text.substr(0, 40), "' is none of auto, pure, none, depth=N, random=N"));
  }
  STRATA_RETURN_IF_ERROR(options.Validate());
  return options;
}

std::string ToString(const ReductionOptions& options) {
  switch (options.kind) {
    case ReductionKind::kNone:
      return "none";
    case ReductionKind::kRandom:
      return absl::StrCat("random=", options.count);
    case ReductionKind::kDepth:
      return absl::StrCat("depth=", options.depth);
    case ReductionKind::kPure:
      return "pure";
    case ReductionKind::kBalanced:
      return "auto";
  }
  return "unknown";
}

}  // namespace strata
