#include "core/classification/learners/instances.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace strata {
namespace {

constexpr Eigen::Index kBlock = 128;  // queries at a time: their distances stay in the cache
constexpr float kNone = -1.0F;

// The places of the `count` smallest values, without `self`.
class Smallest {
 public:
  explicit Smallest(std::size_t count) : found_(count) {}

  void Of(std::span<const float> values, std::size_t self) {
    size_ = 0;
    float bound = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i] >= bound || i == self) continue;
      bound = Insert(values[i], i);
    }
  }
  std::size_t size() const { return size_; }
  std::size_t place(std::size_t k) const { return found_[k].second; }

 private:
  // What the next one has to be below.
  float Insert(float value, std::size_t place) {
    if (size_ < found_.size()) ++size_;
    std::size_t k = size_ - 1;
    for (; k > 0 && found_[k - 1].first > value; --k) found_[k] = found_[k - 1];
    found_[k] = {value, place};
    return size_ < found_.size() ? std::numeric_limits<float>::infinity() : found_.back().first;
  }

  std::vector<std::pair<float, std::size_t>> found_;  // rising
  std::size_t size_ = 0;
};

// Classes with fewer instances repeat their farthest.
void RepeatFarthest(FeatureMatrix& distances, std::size_t count) {
  for (Eigen::Index i = 0; i < distances.rows(); ++i) {
    for (Eigen::Index k = 1; k < distances.cols(); ++k) {
      const bool first = static_cast<std::size_t>(k) % count == 0;
      if (!first && distances(i, k) < 0.0F) distances(i, k) = distances(i, k - 1);
    }
  }
}

}  // namespace

Instances::Instances(const LabelledFeatures& data) : data_(data), classes_(data.classes) {
  for (std::size_t i = 0; i < data.size(); ++i) {
    classes_[data.labels[i]].rows.push_back(static_cast<Eigen::Index>(i));
  }
  for (OfClass& of_class : classes_) {
    of_class.features = data.features(of_class.rows, Eigen::all);
    of_class.squared_norms = of_class.features.rowwise().squaredNorm().transpose();
  }
}

std::size_t Instances::OfClass::PlaceOf(Eigen::Index row) const {
  const auto at = std::lower_bound(rows.begin(), rows.end(), row);
  return at != rows.end() && *at == row ? static_cast<std::size_t>(at - rows.begin()) : rows.size();
}

FeatureMatrix Instances::Nearest(const FeatureMatrix& features,
                                 std::size_t count,
                                 bool within) const {
  FeatureMatrix all = FeatureMatrix::Constant(
      features.rows(), static_cast<Eigen::Index>(classes_.size() * count), kNone);
  Smallest smallest(count);
  FeatureMatrix partial;  // squared distances, without the squared norm of the query
  for (Eigen::Index begin = 0; begin < features.rows(); begin += kBlock) {
    const auto block = features.middleRows(begin, std::min(kBlock, features.rows() - begin));
    for (std::size_t k = 0; k < classes_.size(); ++k) {
      const OfClass& of_class = classes_[k];
      partial.noalias() = block * of_class.features.transpose();
      partial = (-2.0F * partial).rowwise() + of_class.squared_norms;
      for (Eigen::Index i = 0; i < block.rows(); ++i) {
        const std::size_t size = of_class.rows.size();
        smallest.Of({partial.row(i).data(), size}, within ? of_class.PlaceOf(begin + i) : size);
        float* const to = all.row(begin + i).data() + k * count;
        // Anew, as the difference of large numbers leaves little of a small distance.
        for (std::size_t n = 0; n < smallest.size(); ++n) {
          const auto other = static_cast<Eigen::Index>(smallest.place(n));
          to[n] = (block.row(i) - of_class.features.row(other)).norm();
        }
        std::sort(to, to + smallest.size());
      }
    }
  }
  return all;
}

FeatureMatrix Instances::Distances(const FeatureMatrix& features, std::size_t count) const {
  FeatureMatrix all = Nearest(features, count, false);
  RepeatFarthest(all, count);
  return all;
}

FeatureMatrix Instances::DistancesWithin(std::size_t count) const {
  FeatureMatrix all = Nearest(data_.features, count, true);
  RepeatFarthest(all, count);
  const float farthest = all.size() > 0 ? all.maxCoeff() : 0.0F;
  return all.unaryExpr([farthest](float d) { return d < 0.0F ? farthest : d; });
}

ScoreMatrix Instances::Votes(const FeatureMatrix& features, std::size_t count) const {
  const FeatureMatrix distances = Nearest(features, count, false);
  ScoreMatrix votes =
      ScoreMatrix::Zero(features.rows(), static_cast<Eigen::Index>(classes_.size()));
  std::vector<std::pair<float, Eigen::Index>> nearest;
  for (Eigen::Index i = 0; i < features.rows(); ++i) {
    nearest.clear();
    for (Eigen::Index n = 0; n < distances.cols(); ++n) {
      if (distances(i, n) < 0.0F) continue;
      nearest.emplace_back(distances(i, n), n / static_cast<Eigen::Index>(count));
    }
    const std::size_t kept = std::min(count, nearest.size());
    std::partial_sort(
        nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(kept), nearest.end());
    for (std::size_t n = 0; n < kept; ++n) {
      votes(i, nearest[n].second) += 1.0 / static_cast<double>(kept);
    }
  }
  return votes;
}

}  // namespace strata
