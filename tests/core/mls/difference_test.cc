#include "core/mls/difference.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace strata {
namespace {

using Kind = SurfaceChange::Kind;

Surface SurfaceAt(int cell, double z_m, double sigma_m = 0.001) {
  return {.cell = static_cast<std::uint16_t>(cell),
          .z_m = static_cast<float>(z_m),
          .sigma_m = static_cast<float>(sigma_m)};
}

SurfaceTile TileOf(std::vector<Surface> surfaces) {
  SurfaceTile tile;
  tile.surfaces = std::move(surfaces);
  return tile;
}

TEST(DifferenceTest, SurfacesComeGoAndMove) {
  const SurfaceTile earlier = TileOf({SurfaceAt(0, 1.0), SurfaceAt(5, 0.0), SurfaceAt(5, 3.0)});
  const SurfaceTile later = TileOf({SurfaceAt(5, 0.05), SurfaceAt(5, 7.0), SurfaceAt(9, 2.0)});
  const std::vector<SurfaceChange> changes = CompareTiles(earlier, later, 1.0);
  ASSERT_EQ(changes.size(), 5U);
  EXPECT_EQ(changes[0].kind, Kind::kRemoved);
  EXPECT_EQ(changes[0].surface, earlier.surfaces[0]);
  EXPECT_EQ(changes[1].kind, Kind::kMoved);
  EXPECT_EQ(changes[1].surface, later.surfaces[0]);
  EXPECT_FLOAT_EQ(changes[1].rise_m, 0.05F);
  EXPECT_EQ(changes[2].kind, Kind::kRemoved);
  EXPECT_EQ(changes[2].surface, earlier.surfaces[2]);
  EXPECT_EQ(changes[3].kind, Kind::kAdded);
  EXPECT_EQ(changes[4].kind, Kind::kAdded);
  EXPECT_EQ(changes[4].surface, later.surfaces[2]);
}

TEST(DifferenceTest, WhatNoiseExplainsHasNotMoved) {
  const auto kind = [](double rise_m, double sigma_m) {
    return CompareTiles(
               TileOf({SurfaceAt(7, 0.0, sigma_m)}), TileOf({SurfaceAt(7, rise_m, sigma_m)}), 1.0)
        .at(0)
        .kind;
  };
  EXPECT_EQ(kind(0.009, 1e-6), Kind::kSame);
  EXPECT_EQ(kind(-0.011, 1e-6), Kind::kMoved);
  EXPECT_EQ(kind(0.4, 0.1), Kind::kSame);  // 3 √2 · 0.1 = 0.42
  EXPECT_EQ(kind(0.45, 0.1), Kind::kMoved);
  EXPECT_EQ(kind(-0.45, 0.1), Kind::kMoved);
}

std::vector<Surface> RandomSurfaces(std::mt19937_64& random) {
  std::uniform_real_distribution<double> z(-4.0, 4.0);
  std::uniform_real_distribution<double> sigma(0.0, 0.1);
  std::vector<Surface> surfaces;
  for (int cell = 0; cell < 200; ++cell) {
    std::vector<double> heights(random() % 5);
    for (double& height : heights) height = z(random);
    std::sort(heights.begin(), heights.end());
    for (const double height : heights) surfaces.push_back(SurfaceAt(cell, height, sigma(random)));
  }
  return surfaces;
}

// Of one cell, by height.
std::vector<Surface> InCell(const SurfaceTile& tile, int cell) {
  std::vector<Surface> surfaces;
  for (const Surface& surface : tile.surfaces) {
    if (surface.cell == cell) surfaces.push_back(surface);
  }
  return surfaces;
}

double Apart(const Surface& a, const Surface& b) {
  return std::abs(static_cast<double>(a.z_m) - static_cast<double>(b.z_m));
}

// Who is whose partner, from the changes of a cell alone: kNone where there is none.
struct Partners {
  static constexpr double kNone = 1e9;
  std::map<float, double> earlier, later;  // height of a surface → how far its partner is
};

Partners PartnersOf(const std::vector<SurfaceChange>& changes, int cell) {
  Partners partners;
  for (const SurfaceChange& change : changes) {
    if (change.surface.cell != cell) continue;
    const float z = change.surface.z_m;
    if (change.kind == Kind::kRemoved) {
      partners.earlier[z] = Partners::kNone;
    } else if (change.kind == Kind::kAdded) {
      partners.later[z] = Partners::kNone;
    } else {
      partners.later[z] = std::abs(static_cast<double>(change.rise_m));
    }
  }
  return partners;
}

TEST(DifferenceTest, NoTwoSurfacesWouldRatherBeTheSameThanWhatTheyArePairedWith) {
  const std::uint64_t seed = 20261122;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  constexpr double kGap = 1.0;
  int pairs = 0;
  for (int round = 0; round < 20; ++round) {
    const SurfaceTile earlier = TileOf(RandomSurfaces(random));
    const SurfaceTile later = TileOf(RandomSurfaces(random));
    const std::vector<SurfaceChange> changes = CompareTiles(earlier, later, kGap);
    EXPECT_TRUE(std::is_sorted(changes.begin(), changes.end(), [](const auto& a, const auto& b) {
      return std::pair(a.surface.cell, a.surface.z_m) < std::pair(b.surface.cell, b.surface.z_m);
    }));
    for (int cell = 0; cell < 200; ++cell) {
      const std::vector<Surface> before = InCell(earlier, cell);
      const std::vector<Surface> after = InCell(later, cell);
      Partners partners = PartnersOf(changes, cell);
      EXPECT_EQ(partners.later.size(), after.size());
      // The earlier surfaces that were not removed, each found by the rise of its partner.
      for (const SurfaceChange& change : changes) {
        if (change.surface.cell != cell || change.kind == Kind::kRemoved ||
            change.kind == Kind::kAdded) {
          continue;
        }
        const auto was = std::find_if(before.begin(), before.end(), [&](const Surface& surface) {
          return std::abs(Apart(surface, change.surface) - std::abs(change.rise_m)) < 1e-6 &&
                 !partners.earlier.contains(surface.z_m);
        });
        ASSERT_NE(was, before.end());
        partners.earlier[was->z_m] = Apart(*was, change.surface);
        EXPECT_LT(partners.earlier[was->z_m], kGap);
        ++pairs;
      }
      EXPECT_EQ(partners.earlier.size(), before.size());
      for (const Surface& a : before) {
        for (const Surface& b : after) {
          const double apart = Apart(a, b);
          EXPECT_FALSE(apart < kGap && apart < partners.earlier[a.z_m] - 1e-6 &&
                       apart < partners.later[b.z_m] - 1e-6)
              << "cell " << cell << ": " << a.z_m << " and " << b.z_m;
        }
      }
    }
  }
  EXPECT_GT(pairs, 2000);
}

TEST(DifferenceTest, ATileAndItselfAreTheSameAndTheWayBackIsTheOpposite) {
  std::mt19937_64 random(7);
  const SurfaceTile a = TileOf(RandomSurfaces(random));
  const SurfaceTile b = TileOf(RandomSurfaces(random));
  for (const SurfaceChange& change : CompareTiles(a, a, 1.0)) {
    EXPECT_EQ(change.kind, Kind::kSame);
    EXPECT_EQ(change.rise_m, 0.0F);
  }
  const auto count = [](const std::vector<SurfaceChange>& changes, Kind kind) {
    return std::count_if(
        changes.begin(), changes.end(), [kind](const auto& c) { return c.kind == kind; });
  };
  const auto there = CompareTiles(a, b, 1.0);
  const auto back = CompareTiles(b, a, 1.0);
  EXPECT_EQ(count(there, Kind::kAdded), count(back, Kind::kRemoved));
  EXPECT_EQ(count(there, Kind::kRemoved), count(back, Kind::kAdded));
  EXPECT_EQ(count(there, Kind::kMoved), count(back, Kind::kMoved));
  EXPECT_EQ(count(there, Kind::kSame), count(back, Kind::kSame));
}

}  // namespace
}  // namespace strata
