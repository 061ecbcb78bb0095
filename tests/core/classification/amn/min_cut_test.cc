#include "core/classification/amn/min_cut.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/core/classification/amn/random_networks.h"

namespace strata {
namespace {

struct Capacities {
  std::vector<double> terminal, forward, backward;
};

// Of the cut whose sink side is the set bits of `sinks`.
double CostOf(std::uint32_t sinks,
              const std::vector<NetworkEdge>& edges,
              const Capacities& capacities) {
  const auto in_sink = [sinks](std::uint32_t node) { return ((sinks >> node) & 1U) != 0; };
  double cost = 0.0;
  for (std::uint32_t node = 0; node < capacities.terminal.size(); ++node) {
    const double terminal = capacities.terminal[node];
    cost += in_sink(node) ? std::max(0.0, terminal) : std::max(0.0, -terminal);
  }
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (!in_sink(edges[e].i) && in_sink(edges[e].j)) cost += capacities.forward[e];
    if (in_sink(edges[e].i) && !in_sink(edges[e].j)) cost += capacities.backward[e];
  }
  return cost;
}

Capacities RandomCapacities(std::size_t nodes, std::size_t edges, SplitMix64& random) {
  Capacities capacities;
  // Halves and wholes too: ties and edges that are saturated together.
  const auto draw = [&random](double low) {
    const double value = testing::RandomIn(low, 1.0, random);
    return random.Below(2) == 0 ? std::round(2.0 * value) / 2.0 : value;
  };
  for (std::size_t k = 0; k < nodes; ++k) capacities.terminal.push_back(draw(-1.0));
  for (std::size_t k = 0; k < edges; ++k) {
    capacities.forward.push_back(draw(0.0));
    capacities.backward.push_back(random.Below(2) == 0 ? 0.0 : draw(0.0));
  }
  return capacities;
}

TEST(MinCutTest, IsTheCheapestOfAllCuts) {
  constexpr std::uint64_t kSeed = 81;
  SCOPED_TRACE(kSeed);
  SplitMix64 random(kSeed);
  for (int run = 0; run < 3000; ++run) {
    const std::uint32_t nodes = 1 + random.Below(9);
    const std::vector<NetworkEdge> edges =
        nodes < 2 ? std::vector<NetworkEdge>()
                  : testing::RandomEdges(nodes, static_cast<int>(random.Below(20)), random);
    MinCut cut(nodes, edges);
    for (int again = 0; again < 2; ++again) {  // the same graph with other capacities
      const Capacities capacities = RandomCapacities(nodes, edges.size(), random);
      for (std::uint32_t k = 0; k < nodes; ++k) cut.SetTerminal(k, capacities.terminal[k]);
      for (std::size_t e = 0; e < edges.size(); ++e) {
        cut.SetEdge(e, capacities.forward[e], capacities.backward[e]);
      }
      cut.Solve();
      std::uint32_t sinks = 0;
      for (std::uint32_t k = 0; k < nodes; ++k) sinks |= cut.OnSinkSide(k) ? 1U << k : 0U;
      double best = std::numeric_limits<double>::infinity();
      for (std::uint32_t all = 0; all < (1U << nodes); ++all) {
        best = std::min(best, CostOf(all, edges, capacities));
      }
      ASSERT_NEAR(CostOf(sinks, edges, capacities), best, 1e-9) << "run " << run;
    }
  }
}

TEST(MinCutTest, TiesStayAtTheSource) {
  const std::vector<NetworkEdge> edges = {{0, 1}};
  MinCut cut(3, edges);
  cut.SetTerminal(0, 1.0);
  cut.SetTerminal(1, -1.0);
  cut.SetTerminal(2, 0.0);
  cut.SetEdge(0, 1.0, 0.0);
  cut.Solve();
  EXPECT_FALSE(cut.OnSinkSide(0));
  EXPECT_FALSE(cut.OnSinkSide(1));
  EXPECT_FALSE(cut.OnSinkSide(2));
}

}  // namespace
}  // namespace strata
