// Tiles that are made before scans move: the map is that of a move that had nothing ahead, whatever
// comes in between.
#include "core/engine/ingest/tiles_ahead.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/engine/doors/map.h"
#include "core/engine/ingest/scan_intake.h"
#include "core/engine/map/scan_lookup.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

constexpr std::uint64_t kRooms = 8;

class TilesAheadTest : public EngineTest {
 protected:
  using Between = std::function<void(Map&)>;

  static std::vector<PosedScan> ScansOf(Map& map) {
    const auto reader = map.core().Reader();
    EXPECT_THAT(reader, IsOk());
    return (*reader)->ListScans({}, map.core().snapshots().current().epoch).value();
  }
  // Every other scan a little aside.
  static std::vector<ProposedPose> Moves(Map& map) {
    std::vector<ProposedPose> moves;
    for (const PosedScan& posed : ScansOf(map)) {
      if (posed.scan.header.id.sequence % 2 == 1) continue;  // numbers depend on time
      moves.push_back({posed.scan.number, PoseAt(0.3, 0.1, 0.01) * posed.pose->T_map_scan});
    }
    return moves;
  }
  static void UploadTo(Map& map, std::uint64_t i) {
    const PointCloud cloud = MakeRoom(i);
    ScanIntake intake(map.core(), HeaderOf({"late", i}, cloud, RoomPose(i)), std::nullopt);
    STRATA_ASSERT_OK_AND_ASSIGN(const std::uint64_t ticket, intake.Take());
    STRATA_ASSERT_OK(intake.Write(ticket, Stop(), cloud));
    STRATA_ASSERT_OK(intake
                         .Finish(
                             ticket,
                             Stop(),
                             [] { return absl::OkStatus(); },
                             [&map](ScanNumber number) { map.ScanCommitted(number); })
                         .status());
    while (map.worker().HasWork()) absl::SleepFor(absl::Milliseconds(1));
  }
  static void Edit(Map& map, const std::function<absl::Status(Integrator&)>& edit) {
    STRATA_EXPECT_OK(
        map.worker().Execute(Stop(), [&](Integrator& integrator) { return edit(integrator); }));
  }
  // Of a new map of rooms, moved after `between`; `used`: whether what was ahead was of any use.
  std::string DigestOfMoved(const std::string& name, bool with, const Between& between, bool used) {
    Reopen();
    MakeMap(SmallMap(), name);
    UploadRooms(kRooms, name);
    WaitIntegrated(db(), name);
    Close();
    {
      const auto opened = Map::Open(
          name, MapFile(name), Options(), std::make_shared<CacheBudget>(Options().cache_bytes));
      EXPECT_THAT(opened, IsOk());
      Map& map = **opened;
      const std::vector<ProposedPose> moves = Moves(map);
      TilesAhead ahead(map.core());
      STRATA_EXPECT_OK(ahead.Make(moves, 2, Stop()));
      between(map);
      EXPECT_EQ(ahead.IsOfNow(), used);
      EXPECT_NE(ahead.FindScan(moves[0].scan, moves[0].T_map_scan), nullptr);
      EXPECT_EQ(ahead.FindScan(moves[0].scan, moves[1].T_map_scan), nullptr);
      ScanMoves wanted;
      wanted.poses = moves;
      if (with) wanted.ahead = &ahead;
      SilentContext context{Stop()};
      Edit(map, [&](Integrator& integrator) {
        return integrator
            .MoveScans(wanted, 2, context, [](StorageWriter&) { return absl::OkStatus(); })
            .status();
      });
    }
    Reopen();
    const JobInfo verified = RunJob(db(), "verify", {}, name);
    EXPECT_EQ(verified.state, JobState::kSucceeded) << verified.message;
    return WaitIntegrated(db(), name).content_digest;
  }
  void ExpectSame(const Between& between, bool used) {
    const std::string without = DigestOfMoved("without", false, between, used);
    EXPECT_EQ(DigestOfMoved("with", true, between, used), without);
  }
};

TEST_F(TilesAheadTest, TheMapIsThatOfAMoveWithNothingAhead) {
  ExpectSame([](Map&) {}, true);
}

TEST_F(TilesAheadTest, ScansThatComeMeanwhileAreInItsTiles) {
  ExpectSame(
      [](Map& map) {
        UploadTo(map, 3);
        UploadTo(map, 11);
      },
      true);
}

TEST_F(TilesAheadTest, AScanThatIsMovedMeanwhileIsWhereItIsMovedTo) {
  ExpectSame(
      [](Map& map) {
        Edit(map, [](Integrator& integrator) {
          return integrator.SetPose({"run", 3}, RoomPose(5));
        });
      },
      true);
}

TEST_F(TilesAheadTest, LabelsThatAreGivenMeanwhileCount) {
  ExpectSame(
      [](Map& map) {
        Edit(map, [](Integrator& integrator) {
          const std::vector<std::uint16_t> labels(MakeRoom(4).size(), 7);
          return integrator.SetPersonLabels({"run", 4}, labels, false);
        });
      },
      false);
}

}  // namespace
}  // namespace strata::testing
