#include "core/classification/instances.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include <nanoflann.hpp>

namespace strata {
namespace {

constexpr std::size_t kNobody = std::numeric_limits<std::size_t>::max();

// Some rows of a matrix, as nanoflann wants to see them; its method names are given.
struct RowsView {
  const FeatureMatrix& features;
  std::vector<std::size_t> rows;
  std::size_t kdtree_get_point_count() const { return rows.size(); }
  float kdtree_get_pt(std::size_t i, std::size_t k) const {
    return features(static_cast<Eigen::Index>(rows[i]), static_cast<Eigen::Index>(k));
  }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};
using KdTree = nanoflann::
    KDTreeSingleIndexAdaptor<nanoflann::L2_Adaptor<float, RowsView>, RowsView, -1, std::uint32_t>;

}  // namespace

class Instances::Tree {
 public:
  Tree(const FeatureMatrix& features, std::vector<std::size_t> rows)
      : view_{features, std::move(rows)},
        tree_(static_cast<int>(features.cols()),
              view_,
              nanoflann::KDTreeSingleIndexAdaptorParams(10)) {}

  // Distances to the nearest, rising, without row `self`; at most `count`.
  std::vector<float> Nearest(const float* x, std::size_t count, std::size_t self) const {
    std::vector<std::uint32_t> found(count + 1);
    std::vector<float> squared(count + 1);
    const std::size_t n = tree_.knnSearch(x, count + 1, found.data(), squared.data());
    std::vector<float> distances;
    for (std::size_t k = 0; k < n && distances.size() < count; ++k) {
      if (view_.rows[found[k]] != self) distances.push_back(std::sqrt(squared[k]));
    }
    return distances;
  }

 private:
  const RowsView view_;
  const KdTree tree_;
};

Instances::Instances(const LabelledFeatures& data) : data_(data) {
  std::vector<std::vector<std::size_t>> rows(data.classes);
  for (std::size_t i = 0; i < data.size(); ++i) rows[data.labels[i]].push_back(i);
  for (std::vector<std::size_t>& of_class : rows) {
    trees_.push_back(std::make_unique<Tree>(data.features, std::move(of_class)));
  }
}

Instances::~Instances() = default;

FeatureMatrix Instances::Distances(const FeatureMatrix& features, std::size_t count) const {
  FeatureMatrix all(features.rows(), static_cast<Eigen::Index>(trees_.size() * count));
  for (Eigen::Index i = 0; i < features.rows(); ++i) {
    Eigen::Index column = 0;
    for (const auto& tree : trees_) {
      std::vector<float> nearest = tree->Nearest(features.row(i).data(), count, kNobody);
      nearest.resize(count, nearest.back());
      for (const float d : nearest) all(i, column++) = d;
    }
  }
  return all;
}

FeatureMatrix Instances::DistancesWithin(std::size_t count) const {
  const FeatureMatrix& features = data_.features;
  FeatureMatrix all(features.rows(), static_cast<Eigen::Index>(trees_.size() * count));
  for (Eigen::Index i = 0; i < features.rows(); ++i) {
    Eigen::Index column = 0;
    for (const auto& tree : trees_) {
      std::vector<float> nearest =
          tree->Nearest(features.row(i).data(), count, static_cast<std::size_t>(i));
      nearest.resize(count, nearest.empty() ? -1.0F : nearest.back());
      for (const float d : nearest) all(i, column++) = d;
    }
  }
  const float farthest = all.size() > 0 ? all.maxCoeff() : 0.0F;
  return all.unaryExpr([farthest](float d) { return d < 0.0F ? farthest : d; });
}

ScoreMatrix Instances::Votes(const FeatureMatrix& features, std::size_t count) const {
  ScoreMatrix votes = ScoreMatrix::Zero(features.rows(), static_cast<Eigen::Index>(trees_.size()));
  for (Eigen::Index i = 0; i < features.rows(); ++i) {
    std::vector<std::pair<float, Eigen::Index>> nearest;
    for (std::size_t k = 0; k < trees_.size(); ++k) {
      for (const float d : trees_[k]->Nearest(features.row(i).data(), count, kNobody)) {
        nearest.emplace_back(d, static_cast<Eigen::Index>(k));
      }
    }
    const std::size_t kept = std::min(count, nearest.size());
    std::partial_sort(
        nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(kept), nearest.end());
    for (std::size_t k = 0; k < kept; ++k) {
      votes(i, nearest[k].second) += 1.0 / static_cast<double>(kept);
    }
  }
  return votes;
}

}  // namespace strata
