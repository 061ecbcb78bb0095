#include "core/mls/update.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/mls/mls_map.h"
#include "core/mls/patch.h"
#include "tests/core/mls/reference_map.h"

namespace strata {
namespace {

using ::strata::testing::ReferenceMap;
using ::strata::testing::ReferenceMeasurement;
using ::strata::testing::Uniform;
using Outcome = MlsUpdater::Outcome;

// The Kalman filter of eq. 6.1 and 6.2, as printed.
struct Kalman {
  double mean, variance;
  void Update(double z, double z_variance) {
    mean = (z_variance * mean + variance * z) / (variance + z_variance);
    variance = variance * z_variance / (variance + z_variance);
  }
};

TEST(MlsUpdaterTest, FusesLikeTheKalmanFilter) {
  std::mt19937_64 random(3);
  MlsUpdater updater(MlsParameters{});
  Kalman kalman{0.5, std::pow(SigmaOfCode(SigmaCode(0.02)), 2)};
  updater.Update({0.05, 0.05, 0.5}, 0.02);
  for (int i = 0; i < 500; ++i) {
    const double sigma_m = Uniform(random, 0.01, 0.05);
    const double z_m = std::round((0.5 + Uniform(random, -0.02, 0.02)) * 4096) / 4096;
    ASSERT_EQ(updater.Update({0.05, 0.05, z_m}, sigma_m), Outcome::kFused);
    kalman.Update(z_m, std::pow(SigmaOfCode(SigmaCode(sigma_m)), 2));
  }
  const std::vector<Patch> patches = updater.Cell({0, 0});
  ASSERT_EQ(patches.size(), 1U);
  EXPECT_NEAR(patches[0].mean_m(), kalman.mean, 1e-6);
  EXPECT_NEAR(patches[0].sigma_m() / std::sqrt(kalman.variance), 1.0, 1e-3);
}

TEST(MlsUpdaterTest, GoesTheThreeWaysOfTheThesis) {
  MlsUpdater updater(MlsParameters{});
  EXPECT_EQ(updater.Update({0.05, 0.05, 0.0}, 0.01), Outcome::kNewPatch);
  EXPECT_EQ(updater.Update({0.05, 0.05, 0.03}, 0.01), Outcome::kFused);
  EXPECT_EQ(updater.Update({0.05, 0.05, 0.5}, 0.01), Outcome::kNewPatch);  // beyond 3σ
  EXPECT_EQ(updater.patch_count(), 2U);
  MlsUpdater closed(updater.Map());  // closer than γ: one vertical interval
  EXPECT_EQ(closed.patch_count(), 1U);
  EXPECT_TRUE(closed.Cell({0, 0})[0].vertical());
  EXPECT_EQ(closed.Update({0.05, 0.05, 0.25}, 0.01), Outcome::kDisregarded);
  EXPECT_EQ(closed.Update({0.05, 0.05, 2.0}, 0.01), Outcome::kNewPatch);
  EXPECT_EQ(closed.Update({0.05, 0.05, std::nan("")}, 0.01), Outcome::kOutsideMap);
  EXPECT_EQ(closed.Update({0.05, 1e12, 0}, 0.01), Outcome::kOutsideMap);
  EXPECT_EQ(closed.Update({0.05, 0, 2048.1}, 0.01), Outcome::kOutsideMap);
}

TEST(MlsUpdaterTest, GateStaysOpenAfterManyMeasurements) {
  MlsUpdater updater(MlsParameters{});
  for (int i = 0; i < 10000; ++i) updater.Update({0.05, 0.05, 0.0}, 0.002);
  // The fused σ is 0.02 mm; the thesis' gate would be 0.06 mm.
  EXPECT_EQ(updater.Update({0.05, 0.05, 0.015}, 0.002), Outcome::kFused);
}

// Counts of vertical patches may be lower; everything else must agree with creation.
void ExpectEqualUpToVerticalCounts(MlsMap live, MlsMap created) {
  ASSERT_EQ(live.patch_count(), created.patch_count());
  ASSERT_EQ(live.tiles.size(), created.tiles.size());
  for (std::size_t t = 0; t < live.tiles.size(); ++t) {
    for (std::size_t i = 0; i < live.tiles[t].patches.size(); ++i) {
      Patch& a = live.tiles[t].patches[i];
      Patch& b = created.tiles[t].patches[i];
      ASSERT_LE(a.count, b.count);
      if (a.vertical()) a.count = b.count;
    }
  }
  ASSERT_TRUE(live == created);
}

TEST(MlsUpdaterTest, ClosedMapIsTheCreatedMapWhateverTheOrder) {
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const MlsParameters parameters{.cell_size_m = 0.1,
                                   .gap_size_m = Uniform(random, 0.05, 1.5),
                                   .thickness_m = Uniform(random, 0.01, 0.3)};
    MlsUpdater updater(parameters);
    std::vector<ReferenceMeasurement> measurements(random() % 300);
    const int span = 1 + static_cast<int>(random() % 16000);
    for (ReferenceMeasurement& m : measurements) {
      m.cell = {static_cast<std::int32_t>(random() % 6) - 3,
                static_cast<std::int32_t>(random() % 6) - 3};
      m.z = static_cast<std::int64_t>(random() % span) - span / 2;
      m.sigma_code = static_cast<std::uint8_t>(random() % 256);
      updater.Update(m.cell, static_cast<std::int32_t>(m.z), m.sigma_code);
    }
    ExpectEqualUpToVerticalCounts(updater.Map(), ReferenceMap(measurements, parameters));
  }
}

// Thesis 6.5.2 against 6.5.3 on a drawn scene: ground with noise, a wall, a table, measured from
// far and near. The issue asks for 99 % of the means within 1 σ and patch counts within 1 %.
TEST(MlsUpdaterTest, AgreesWithCreationOnANoisyScene) {
  std::mt19937_64 random(21);
  const MlsParameters parameters;
  const auto gauss = [&random](double sigma) {
    return sigma * std::sqrt(-2 * std::log(Uniform(random, 1e-12, 1))) *
           std::cos(2 * M_PI * Uniform(random, 0, 1));
  };
  MlsUpdater updater(parameters);
  std::vector<ReferenceMeasurement> measurements;
  for (int i = 0; i < 200000; ++i) {
    const double x = Uniform(random, -5, 5);
    const double y = Uniform(random, -5, 5);
    const double sigma_m = 0.01 + 0.0005 * Uniform(random, 1, 80);
    const double surface = x > 4.5   ? Uniform(random, 0, 3)
                           : y > 3.0 ? (random() % 2 == 0 ? 0.0 : 1.8)
                                     : 0.05 * x;
    const double z = surface + gauss(sigma_m);
    updater.Update({x, y, z}, sigma_m);
    measurements.push_back({.cell = {static_cast<std::int32_t>(std::floor(x / 0.1)),
                                     static_cast<std::int32_t>(std::floor(y / 0.1))},
                            .z = static_cast<std::int64_t>(std::floor(z * 4096 + 0.5)),
                            .sigma_code = SigmaCode(sigma_m)});
  }
  ExpectEqualUpToVerticalCounts(updater.Map(), ReferenceMap(measurements, parameters));
}

}  // namespace
}  // namespace strata
