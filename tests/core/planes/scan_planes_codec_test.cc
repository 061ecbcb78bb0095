#include "core/planes/scan_planes_codec.h"

#include <cstdint>
#include <limits>
#include <string>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/planes/extraction.h"
#include "core/planes/scan_planes.h"
#include "tests/core/codec/hostile.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

ScanPlanes PlanesOfAYard() {
  testing::Scene scene;
  scene.Add(testing::Box({-40, -40, -1}, {40, 40, 0}));
  scene.Add(testing::Box({8.1, -6, 0}, {16, 6, 5}));
  scene.Build();
  testing::SensorOptions sensor;
  sensor.organised = true;
  const Pose T = MakePose(Eigen::Quaterniond::Identity(), {0, 0, 1.6});
  return ExtractPlanes(SimulateScan(scene, sensor, T, 1));
}

TEST(ScanPlanesCodecTest, TheSameValueComesBack) {
  const ScanPlanes planes = PlanesOfAYard();
  ASSERT_FALSE(planes.patches.empty());
  ASSERT_FALSE(planes.edges.empty());
  const std::string bytes = EncodeScanPlanes(planes);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanPlanes decoded, DecodeScanPlanes(bytes));
  EXPECT_EQ(decoded, planes);
  EXPECT_EQ(EncodeScanPlanes(decoded), bytes);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanPlanes nothing, DecodeScanPlanes(EncodeScanPlanes({})));
  EXPECT_EQ(nothing, ScanPlanes{});
}

TEST(ScanPlanesCodecTest, DamageIsDataLoss) {
  testing::ExpectDamageIsDataLoss(EncodeScanPlanes(PlanesOfAYard()), &DecodeScanPlanes, 2, 500);
}

TEST(ScanPlanesCodecTest, ForgedBodiesAreRefusedOrHarmless) {
  const int accepted = testing::DecodeForgedBodies(
      BlobKind::kScanPlanes, EncodeScanPlanes(PlanesOfAYard()), &DecodeScanPlanes, 3, 2000);
  EXPECT_GT(accepted, 0);
  EXPECT_LT(accepted, 2000);
}

TEST(ScanPlanesCodecTest, LiesAboutSizesAndNumbersAreFound) {
  std::string body;
  PutVarint(body, 1'000'000'000);
  PutVarint(body, 0);
  const auto decode = [](const std::string& b) {
    return DecodeScanPlanes(SealBlob(BlobKind::kScanPlanes, kScanPlanesVersion, b));
  };
  EXPECT_THAT(decode(body), StatusIs(absl::StatusCode::kDataLoss, HasSubstr("1000000000")));
  body.clear();
  PutVarint(body, 0);
  PutVarint(body, 1);
  PutVarint(body, std::uint64_t{1} << 60);
  EXPECT_THAT(decode(body), StatusIs(absl::StatusCode::kDataLoss, HasSubstr("vertices")));
  ScanPlanes planes = PlanesOfAYard();
  planes.patches[0].rms_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(DecodeScanPlanes(EncodeScanPlanes(planes)),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("out of range")));
}

}  // namespace
}  // namespace strata
