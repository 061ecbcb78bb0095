// Which points of a cloud are neighbours in a Markov network (thesis 9.3.5).
#ifndef STRATA_CORE_CLASSIFICATION_AMN_NETWORK_H_
#define STRATA_CORE_CLASSIFICATION_AMN_NETWORK_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"

#include "core/classification/features/neighbours.h"

namespace strata {

struct NetworkEdge {
  std::uint32_t i = 0, j = 0;  // i < j
  friend bool operator==(const NetworkEdge&, const NetworkEdge&) = default;
};

struct NetworkOptions {
  int max_degree = 3;  // edges of a point, at most; in [1, 16]
  int draws = 8;       // tries of a point to find a neighbour; in [1, 1000]
  // Width of the Gaussian by which neighbours are drawn, in spacings of the points around; in
  // (0, 100].
  double sigma_spacings = 2.0;
  std::uint64_t seed = 1;

  absl::Status Validate() const;
};

// Every point draws neighbours by a Gaussian of their distance, out of those that it knows; an edge
// is there once and no point has more than `max_degree`. By i, then j. `options` must be valid. The
// same for the same neighbours and seed.
std::vector<NetworkEdge> DrawNetwork(const Neighbours& neighbours, const NetworkOptions& options);
// Draws a network of points, whose neighbours are looked for first: 16 of each.
std::vector<NetworkEdge> DrawNetwork(std::span<const Eigen::Vector3f> points,
                                     const NetworkOptions& options);

// The network of points as one of rows that stand for several points each.
struct ContractedNetwork {
  std::vector<NetworkEdge> edges;          // one for every edge between points of two rows
  std::vector<std::uint32_t> inner_edges;  // of every row: how many are among its points
};

// `row_of`: of every point, below `rows`. By i, then j.
ContractedNetwork Contract(std::span<const NetworkEdge> edges,
                           std::span<const std::uint32_t> row_of,
                           std::size_t rows);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_AMN_NETWORK_H_
