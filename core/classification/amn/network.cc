#include "core/classification/amn/network.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "core/common/option_checks.h"
#include "core/common/random.h"

namespace strata {
namespace {

constexpr std::size_t kCandidates = 16;  // for a point's few neighbours

bool IsBefore(const NetworkEdge& a, const NetworkEdge& b) {
  return a.i != b.i ? a.i < b.i : a.j < b.j;
}

// What a network is drawn with.
class Drawer {
 public:
  Drawer(const Neighbours& neighbours, const NetworkOptions& options)
      : neighbours_(neighbours), options_(options), degree_(neighbours.size(), 0) {}

  std::vector<NetworkEdge> Run() {
    for (std::uint32_t point = 0; point < degree_.size(); ++point) DrawFor(point);
    std::sort(edges_.begin(), edges_.end(), IsBefore);
    return std::move(edges_);
  }

 private:
  bool Full(std::uint32_t point) const { return degree_[point] >= options_.max_degree; }

  // One of the neighbours, by a Gaussian of its distance.
  std::uint32_t Draw(std::uint32_t point, double total, SplitMix64& random) const {
    double left = random.Uniform() * total;
    std::size_t k = 0;
    while (k + 1 < weights_.size() && left >= weights_[k]) left -= weights_[k++];
    return neighbours_.Of(point)[k];
  }

  double Weigh(std::uint32_t point) {
    const std::span<const float> squared = neighbours_.SquaredDistances(point);
    // The spacing: what the third neighbour, the last of a full degree, is away.
    const std::size_t third = std::min<std::size_t>(2, squared.size() - 1);
    const double variance =
        std::pow(options_.sigma_spacings, 2) * std::max(1e-12, static_cast<double>(squared[third]));
    weights_.resize(squared.size());
    double total = 0.0;
    for (std::size_t k = 0; k < squared.size(); ++k) {
      weights_[k] = std::exp(-0.5 * static_cast<double>(squared[k]) / variance);
      total += weights_[k];
    }
    return total;
  }

  void DrawFor(std::uint32_t point) {
    if (neighbours_.count() == 0 || Full(point)) return;
    const double total = Weigh(point);
    SplitMix64 random(options_.seed ^ (std::uint64_t{point} << 20));
    for (int draw = 0; draw < options_.draws && !Full(point); ++draw) {
      const std::uint32_t other = Draw(point, total, random);
      const NetworkEdge edge{std::min(point, other), std::max(point, other)};
      if (Full(other) || Known(edge)) continue;
      edges_.push_back(edge);
      of_point_[edge.i].push_back(edge.j);
      ++degree_[point];
      ++degree_[other];
    }
  }

  bool Known(const NetworkEdge& edge) const {
    const auto& others = of_point_[edge.i];
    return std::find(others.begin(), others.end(), edge.j) != others.end();
  }

  const Neighbours& neighbours_;
  const NetworkOptions& options_;
  std::vector<int> degree_;
  std::vector<double> weights_;
  std::vector<NetworkEdge> edges_;
  std::vector<std::vector<std::uint32_t>> of_point_{neighbours_.size()};  // larger ones
};

}  // namespace

absl::Status NetworkOptions::Validate() const {
  OptionChecks checks("network options");
  checks.InRange("max_degree", max_degree, 1, 16);
  checks.InRange("draws", draws, 1, 1000);
  checks.InRange("sigma_spacings", sigma_spacings, 1e-3, 100.0);
  return checks.status();
}

std::vector<NetworkEdge> DrawNetwork(const Neighbours& neighbours, const NetworkOptions& options) {
  return Drawer(neighbours, options).Run();
}

std::vector<NetworkEdge> DrawNetwork(std::span<const Eigen::Vector3f> points,
                                     const NetworkOptions& options) {
  return DrawNetwork(Neighbours::Find(points, kCandidates), options);
}

ContractedNetwork Contract(std::span<const NetworkEdge> edges,
                           std::span<const std::uint32_t> row_of,
                           std::size_t rows) {
  ContractedNetwork contracted;
  contracted.inner_edges.resize(rows, 0);
  for (const NetworkEdge& edge : edges) {
    const auto [low, high] = std::minmax(row_of[edge.i], row_of[edge.j]);
    if (low == high) {
      ++contracted.inner_edges[low];
    } else {
      contracted.edges.push_back({low, high});
    }
  }
  std::sort(contracted.edges.begin(), contracted.edges.end(), IsBefore);
  return contracted;
}

}  // namespace strata
