// Scans that come as ready local maps.
#include <cstdint>
#include <iostream>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/api/database.h"
#include "core/codec/local_map_codec.h"
#include "core/mls/build.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using Code = absl::StatusCode;

class LocalMapUploadTest : public EngineTest {
 protected:
  static MapParameters Parameters(bool keep_points) {
    MapParameters parameters = SmallMap();
    parameters.keep_points = keep_points;
    return parameters;
  }
  static std::string LocalMapOf(const PointCloud& cloud,
                                const MapParameters& parameters = SmallMap()) {
    auto built = BuildMlsMap(cloud, Pose::Identity(), parameters.sensor, parameters.mls);
    EXPECT_THAT(built, IsOk());
    return built.ok() ? EncodeLocalMap(built->map).value() : "";
  }
  absl::Status Send(const ScanId& id, const Pose& T_map_scan, const std::string& bytes) {
    return db()
        .scans()
        .UploadLocalMap({}, kMapName, HeaderOf(id, {}, T_map_scan), SmallMap().mls, bytes)
        .status();
  }
  // Once it is integrated.
  Pose PlaceOf(const ScanId& id) {
    WaitIntegrated(db());
    const auto info = db().scans().Get({}, kMapName, id);
    EXPECT_THAT(info, IsOk());
    return info.ok() ? info->T_map_scan : Pose::Identity();
  }
};

// A map that drops points is made of local maps: it does not matter who made them.
TEST_F(LocalMapUploadTest, MakesTheMapThatItsPointsMakeWhereTheyAreDropped) {
  MakeMap(Parameters(false));
  for (std::uint64_t i = 1; i <= 3; ++i) {
    const PointCloud cloud = MakeRoom(i);
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", i}, cloud, RoomPose(i)), cloud));
  }
  const std::string from_points = Digest();
  for (const bool keep_points : {false, true}) {
    STRATA_ASSERT_OK(db().maps().Delete({}, kMapName));
    MakeMap(Parameters(keep_points));
    for (std::uint64_t i = 1; i <= 3; ++i) {
      STRATA_ASSERT_OK(Send({"run", i}, RoomPose(i), LocalMapOf(MakeRoom(i))));
    }
    EXPECT_EQ(Digest(), from_points) << keep_points;
    ExpectSound();
    EXPECT_EQ(RunJob(db(), "rebuild").state, JobState::kSucceeded);
    EXPECT_EQ(Digest(), from_points) << keep_points;
    Reopen();
    EXPECT_EQ(Digest(), from_points) << keep_points;
  }
}

TEST_F(LocalMapUploadTest, IsAlignedMovedAndDeletedLikeAnyScan) {
  MapParameters parameters = SmallMap();
  parameters.mls.cell_size_m = 0.1;  // of which points are matched, too
  parameters.keep_points = false;    // all comes from the local map from the first moment
  MakeMap(parameters);
  const Pose first = PoseAt(0.0, 0.0);
  const Pose second = PoseAt(2.0, 1.0, 0.3);
  const PointCloud cloud = SeeWorld(first, 1, 200'000);
  const PointCloud later = SeeWorld(second, 2, 200'000);
  STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", 1}, cloud, first), cloud));
  const std::string alone = Digest();
  Pose guess = second;
  guess.translation() += Eigen::Vector3d(0.15, -0.1, 0.0);
  STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", 2}, later, guess, Alignment::kOn), later));
  const Pose of_points = PlaceOf({"run", 2});
  EXPECT_GT((of_points.translation() - guess.translation()).norm(), 0.02);  // it was moved
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 2}));

  const ScanHeader header = HeaderOf({"run", 2}, {}, guess, Alignment::kOn);
  STRATA_ASSERT_OK(db().scans().UploadLocalMap(
      {}, kMapName, header, parameters.mls, LocalMapOf(later, parameters)));
  EXPECT_EQ(PlaceOf({"run", 2}).matrix(), of_points.matrix());

  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", 2}, PoseAt(30.0, 0.0, 1.0)));
  EXPECT_NE(Digest(), alone);
  ExpectSound();
  STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 2}));
  EXPECT_EQ(Digest(), alone);
}

TEST_F(LocalMapUploadTest, HostileBytesAreRefused) {
  MakeMap();
  const std::string good = LocalMapOf(MakeRoom(1));
  constexpr std::uint64_t kSeed = 4;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937_64 random(kSeed);
  for (int round = 0; round < 300; ++round) {
    std::string bad = good;
    const std::size_t place = random() % bad.size();
    if (round % 3 == 0) {
      bad.resize(place);
    } else {
      bad[place] = static_cast<char>(bad[place] ^ (1 << random() % 8));
    }
    const absl::Status refused = Send({"run", 1}, PoseAt(0, 0), bad);
    // Cut between two tiles it is a smaller map; nothing else can be taken.
    if (refused.ok()) {
      EXPECT_EQ(round % 3, 0);
      STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", 1}));
    }
  }
  EXPECT_THAT(Send({"run", 1}, PoseAt(0, 0), std::string(api::kMaxLocalMapBytes + 1, 'x')),
              StatusIs(Code::kResourceExhausted, HasSubstr("split it")));
  MlsMap far = *DecodeLocalMap(good, SmallMap().mls);
  for (MlsTile& tile : far.tiles) tile.key.x += 1 << 20;
  EXPECT_THAT(Send({"run", 1}, PoseAt(0, 0), *EncodeLocalMap(far)),
              StatusIs(Code::kInvalidArgument, HasSubstr("1e6 m")));
  MlsMap wide = *DecodeLocalMap(good, SmallMap().mls);
  wide.tiles.resize(1);
  while (wide.tiles.size() <= 4'096) {
    wide.tiles.push_back(wide.tiles.back());
    ++wide.tiles.back().key.x;
  }
  EXPECT_THAT(Send({"run", 1}, PoseAt(0, 0), *EncodeLocalMap(wide)),
              StatusIs(Code::kResourceExhausted, HasSubstr("more than 2097152 patches")));
  for (MlsTile& tile : wide.tiles) {
    tile.patches.resize(1);
    tile.IndexRows();
  }
  EXPECT_THAT(Send({"run", 1}, PoseAt(0, 0), *EncodeLocalMap(wide)),
              StatusIs(Code::kInvalidArgument, HasSubstr("more than 4096 tiles")));
}

TEST_F(LocalMapUploadTest, AnEmptyOneFailsToBeIntegratedAndSaysWhy) {
  MakeMap();
  STRATA_ASSERT_OK(Send({"run", 1}, PoseAt(0, 0), ""));
  WaitIntegrated(db());
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo info, db().scans().Get({}, kMapName, {"run", 1}));
  EXPECT_EQ(info.state, ScanState::kFailed);
}

}  // namespace
}  // namespace strata::testing
