#include "core/classification/amn/network.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/random.h"

namespace strata {
namespace {

std::vector<Eigen::Vector3f> Cloud(std::size_t count, std::uint64_t seed) {
  SplitMix64 random(seed);
  std::vector<Eigen::Vector3f> points(count);
  for (Eigen::Vector3f& p : points) {
    for (float& x : p) x = static_cast<float>(10.0 * random.Uniform());
  }
  return points;
}

TEST(NeighboursTest, AreTheNearestOfAll) {
  std::vector<Eigen::Vector3f> points = Cloud(400, 3);
  for (int k = 0; k < 12; ++k) points.push_back(points[7]);  // many at one place
  const Neighbours neighbours = Neighbours::Find(points, 6);
  ASSERT_EQ(neighbours.size(), points.size());
  ASSERT_EQ(neighbours.count(), 6U);
  for (std::size_t p = 0; p < points.size(); ++p) {
    std::vector<float> all;
    for (std::size_t q = 0; q < points.size(); ++q) {
      if (q != p) all.push_back((points[p] - points[q]).squaredNorm());
    }
    std::sort(all.begin(), all.end());
    for (std::size_t k = 0; k < 6; ++k) {
      const std::uint32_t other = neighbours.Of(p)[k];
      EXPECT_NE(other, p);
      EXPECT_NEAR(neighbours.SquaredDistances(p)[k], all[k], 1e-5F) << p;
      EXPECT_NEAR((points[p] - points[other]).squaredNorm(), all[k], 1e-5F) << p;
    }
  }
}

// A grid has many equally far ones.
TEST(NeighboursTest, EquallyFarOnesGoByIndexAlsoAmongOtherPoints) {
  std::vector<Eigen::Vector3f> points;
  for (int k = 0; k < 500; ++k) {
    points.emplace_back(
        static_cast<float>(k % 8), static_cast<float>(k / 8 % 8), static_cast<float>(k / 64));
  }
  std::vector<Eigen::Vector3f> queries(points.begin(), points.begin() + 100);
  for (Eigen::Vector3f& q : queries) q += Eigen::Vector3f(0.5F, 2.0F, -1.0F);
  const Neighbours neighbours = Neighbours::Find(queries, points, 16);
  for (std::size_t q = 0; q < queries.size(); ++q) {
    std::vector<std::pair<float, std::uint32_t>> all;
    for (std::uint32_t p = 0; p < points.size(); ++p) {
      all.emplace_back((points[p] - queries[q]).squaredNorm(), p);
    }
    std::sort(all.begin(), all.end());
    for (std::size_t k = 0; k < 16; ++k) {
      ASSERT_EQ(neighbours.Of(q)[k], all[k].second) << q;
      ASSERT_EQ(neighbours.SquaredDistances(q)[k], all[k].first) << q;
    }
  }
}

// As sensors report that saw nothing. Would not end if everybody were held against everybody.
TEST(NeighboursTest, ManyAtOnePlaceAreCheap) {
  std::vector<Eigen::Vector3f> points(50'000, Eigen::Vector3f::Zero());
  points.emplace_back(1.0F, 0.0F, 0.0F);
  const Neighbours neighbours = Neighbours::Find(points, 3);
  EXPECT_THAT(neighbours.Of(0), ::testing::ElementsAre(1, 2, 3));
  EXPECT_THAT(neighbours.Of(2), ::testing::ElementsAre(0, 1, 3));
  EXPECT_THAT(neighbours.Of(30'000), ::testing::ElementsAre(0, 1, 2));
  EXPECT_THAT(neighbours.Of(50'000), ::testing::ElementsAre(0, 1, 2));
}

// Spacings of a millimetre beside some of kilometres, among which leaves reach far.
TEST(NeighboursTest, OfUnevenCloudsAreThoseOfBruteForce) {
  std::vector<Eigen::Vector3f> points = Cloud(2000, 6);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] *= i % 50 == 0 ? 1e3F : 1e-2F;
  for (const std::size_t count : {1, 16, 64}) {
    const Neighbours neighbours = Neighbours::Find(points, count);
    for (std::size_t i = 0; i < points.size(); i += 29) {
      std::vector<std::pair<float, std::uint32_t>> all;
      for (std::uint32_t p = 0; p < points.size(); ++p) {
        const Eigen::Vector3f d = points[p] - points[i];
        if (p != i) all.emplace_back(d.x() * d.x() + d.y() * d.y() + d.z() * d.z(), p);
      }
      std::sort(all.begin(), all.end());
      for (std::size_t k = 0; k < count; ++k) {
        ASSERT_EQ(neighbours.SquaredDistances(i)[k], all[k].first) << i;
        ASSERT_EQ(neighbours.Of(i)[k], all[k].second) << i;
      }
    }
  }
}

TEST(NeighboursTest, SmallCloudsHaveFewer) {
  EXPECT_EQ(Neighbours::Find({}, 5).size(), 0U);
  EXPECT_EQ(Neighbours::Find(Cloud(1, 1), 5).count(), 0U);
  const Neighbours three = Neighbours::Find(Cloud(3, 1), 5);
  EXPECT_EQ(three.count(), 2U);
}

TEST(NetworkTest, NoPointHasMoreThanThreeAndMostHaveSome) {
  const Neighbours neighbours = Neighbours::Find(Cloud(3000, 4), 16);
  const std::vector<NetworkEdge> edges = DrawNetwork(neighbours, {});
  std::vector<int> degree(neighbours.size(), 0);
  for (const NetworkEdge& edge : edges) {
    ASSERT_LT(edge.i, edge.j);
    ++degree[edge.i];
    ++degree[edge.j];
    const auto of = neighbours.Of(edge.i);
    const auto back = neighbours.Of(edge.j);
    EXPECT_TRUE(std::find(of.begin(), of.end(), edge.j) != of.end() ||
                std::find(back.begin(), back.end(), edge.i) != back.end());
  }
  EXPECT_LE(*std::max_element(degree.begin(), degree.end()), 3);
  EXPECT_GT(edges.size(), 1.2 * 3000);
  EXPECT_EQ(std::adjacent_find(edges.begin(), edges.end()), edges.end());
  EXPECT_EQ(edges, DrawNetwork(neighbours, {}));
  EXPECT_NE(edges, DrawNetwork(neighbours, {.seed = 2}));
}

TEST(NetworkTest, NearNeighboursAreLikelier) {
  const Neighbours neighbours = Neighbours::Find(Cloud(3000, 5), 16);
  const auto mean_rank = [&](double sigma) {
    NetworkOptions options;
    options.sigma_spacings = sigma;
    double sum = 0.0;
    std::size_t count = 0;
    for (const NetworkEdge& edge : DrawNetwork(neighbours, options)) {
      const auto of = neighbours.Of(edge.i);
      sum += static_cast<double>(std::find(of.begin(), of.end(), edge.j) - of.begin());
      ++count;
    }
    return sum / static_cast<double>(count);
  };
  EXPECT_LT(mean_rank(0.5), mean_rank(2.0));
  EXPECT_LT(mean_rank(2.0), mean_rank(50.0));
}

TEST(NetworkTest, ContractionKeepsEveryEdge) {
  // Rows a = {0, 1, 4}, b = {2}, c = {3, 5}.
  const std::vector<NetworkEdge> edges = {{0, 1}, {0, 2}, {0, 4}, {2, 4}, {3, 4}, {3, 5}};
  const ContractedNetwork contracted =
      Contract(edges, std::vector<std::uint32_t>{0, 0, 1, 2, 0, 2}, 3);
  EXPECT_EQ(contracted.inner_edges, (std::vector<std::uint32_t>{2, 0, 1}));
  EXPECT_EQ(contracted.edges, (std::vector<NetworkEdge>{{0, 1}, {0, 1}, {0, 2}}));
}

}  // namespace
}  // namespace strata
