#include "tests/bench/classification/classification_peers.h"

#include <string>
#include <utility>

#include <CGAL/Classification.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/boost/graph/Alpha_expansion_MaxFlow_tag.h>
#include <CGAL/property_map.h>

namespace strata::bench {
namespace {

namespace Classification = CGAL::Classification;

using Kernel = CGAL::Simple_cartesian<double>;
using Points = std::vector<Kernel::Point_3>;
using Generator =
    Classification::Point_set_feature_generator<Kernel,
                                                Points,
                                                CGAL::Identity_property_map<Kernel::Point_3>,
                                                CGAL::Sequential_tag>;

// A column of a matrix that may be changed for another one.
class Column : public Classification::Feature_base {
 public:
  Column(const FeatureMatrix* const* matrix, Eigen::Index column)
      : matrix_(matrix), column_(column) {}
  float value(std::size_t i) override { return (**matrix_)(static_cast<Eigen::Index>(i), column_); }

 private:
  const FeatureMatrix* const* matrix_;
  Eigen::Index column_;
};

}  // namespace

FeatureMatrix CgalFeatures(std::span<const Eigen::Vector3f> points,
                           std::size_t scales,
                           float voxel_m) {
  Points input;
  input.reserve(points.size());
  for (const Eigen::Vector3f& p : points) input.emplace_back(p.x(), p.y(), p.z());
  Generator generator(input, {}, scales, voxel_m);
  Classification::Feature_set features;
  generator.generate_point_based_features(features);
  FeatureMatrix matrix(static_cast<Eigen::Index>(points.size()),
                       static_cast<Eigen::Index>(features.size()));
  for (std::size_t f = 0; f < features.size(); ++f) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(f)) = features[f]->value(i);
    }
  }
  return matrix;
}

class CgalForest::Impl {
 public:
  explicit Impl(const LabelledFeatures& data) : shown_(&data.features), forest_(labels_, columns_) {
    for (std::size_t k = 0; k < data.classes; ++k) labels_.add(std::to_string(k).c_str());
    for (Eigen::Index f = 0; f < data.features.cols(); ++f) columns_.add<Column>(&shown_, f);
    const std::vector<int> truth(data.labels.begin(), data.labels.end());
    forest_.train<CGAL::Sequential_tag>(truth);
  }

  ScoreMatrix Probabilities(const FeatureMatrix& features) {
    shown_ = &features;
    ScoreMatrix all(features.rows(), static_cast<Eigen::Index>(labels_.size()));
    std::vector<float> one;
    for (Eigen::Index i = 0; i < features.rows(); ++i) {
      forest_(static_cast<std::size_t>(i), one);
      for (std::size_t k = 0; k < one.size(); ++k) {
        all(i, static_cast<Eigen::Index>(k)) = static_cast<double>(one[k]);
      }
    }
    return all;
  }

 private:
  const FeatureMatrix* shown_;
  Classification::Label_set labels_;
  Classification::Feature_set columns_;
  Classification::ETHZ::Random_forest_classifier forest_;
};

CgalForest::CgalForest(const LabelledFeatures& data) : impl_(std::make_unique<Impl>(data)) {}
CgalForest::~CgalForest() = default;

ScoreMatrix CgalForest::Probabilities(const FeatureMatrix& features) const {
  return impl_->Probabilities(features);
}

std::vector<ClassIndex> CgalGraphCut(GraphCut method,
                                     const ScoreMatrix& costs,
                                     std::span<const NetworkEdge> edges,
                                     double strength) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const NetworkEdge& edge : edges) pairs.emplace_back(edge.i, edge.j);
  const std::vector<double> weights(pairs.size(), strength);
  std::vector<std::vector<double>> matrix;
  for (Eigen::Index k = 0; k < costs.cols(); ++k) {
    matrix.emplace_back(costs.col(k).begin(), costs.col(k).end());
  }
  const std::vector<ClassIndex> start = LargestScores(-costs);
  std::vector<std::size_t> labels(start.begin(), start.end());
  if (method == GraphCut::kBoost) {
    CGAL::alpha_expansion_graphcut(pairs, weights, matrix, labels);
  } else {
    CGAL::alpha_expansion_graphcut(
        pairs, weights, matrix, labels, CGAL::Alpha_expansion_MaxFlow_tag());
  }
  return {labels.begin(), labels.end()};
}

}  // namespace strata::bench
