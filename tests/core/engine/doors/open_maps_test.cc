// Maps are opened when somebody needs them or they have something to do, and let go afterwards.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/engine/map/numbers.h"
#include "core/world/job_kinds.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/patience.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::_;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

int Threads() {
  return static_cast<int>(std::distance(fs::directory_iterator("/proc/self/task"), {}));
}

class OpenMapsTest : public EngineTest {
 protected:
  // A writer's connection has the log of its map open.
  bool IsOpen(const std::string& map = kMapName) const {
    return fs::exists(MapFile(map).string() + "-wal");
  }
  static bool Becomes(const std::function<bool()>& so) {
    const absl::Time end = absl::Now() + kPatience;
    while (!so() && absl::Now() < end) absl::SleepFor(absl::Milliseconds(10));
    return so();
  }
  EngineOptions Idle(absl::Duration idle) const {
    EngineOptions options = Options();
    options.prepare_after = absl::InfiniteDuration();
    options.map_idle = idle;
    options.look_interval = absl::Milliseconds(50);
    return options;
  }
  std::vector<std::string> Listed() {
    std::vector<std::string> names;
    const auto maps = db().maps().List({});
    STRATA_EXPECT_OK(maps);
    for (const MapInfo& map : *maps) names.push_back(map.name);
    return names;
  }
};

TEST_F(OpenMapsTest, AStartOpensNoMapThatHasNothingToDo) {
  for (int i = 0; i < 20; ++i) MakeMap(SmallMap(), absl::StrCat("map", i));
  UploadRooms(2, "map7");
  const MapStats stats = WaitIntegrated(db(), "map7");
  Close();
  const int before = Threads();
  Reopen();
  const auto infos = db().maps().List({});
  STRATA_ASSERT_OK(infos);
  EXPECT_EQ(infos->size(), 20U);
  EXPECT_EQ((*infos)[7].parameters, SmallMap());
  EXPECT_EQ(Threads(), before + 1);
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(IsOpen(absl::StrCat("map", i))) << i;
  // What is known of them is told all the same.
  const EngineNumbers numbers = NumbersOf(db());
  ASSERT_EQ(numbers.maps.size(), 20U);
  const auto seventh = std::find_if(
      numbers.maps.begin(), numbers.maps.end(), [](const auto& map) { return map.map == "map7"; });
  EXPECT_EQ(seventh->scans, 2U);
  EXPECT_EQ(seventh->tiles, stats.tiles);
  EXPECT_GT(seventh->file_bytes, 0U);
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats again, db().maps().Stats({}, "map7"));
  EXPECT_EQ(again.content_digest, stats.content_digest);
  EXPECT_EQ(Threads(), before + 4);
  EXPECT_TRUE(IsOpen("map7"));
}

TEST_F(OpenMapsTest, WhatIsIdleIsLetGoAndComesBackAsItWas) {
  Reopen(Idle(absl::Milliseconds(100)));
  MakeMap();
  UploadRooms(3);
  const MapStats before = WaitIntegrated(db());
  const auto tiles = AllTiles(db());
  EXPECT_TRUE(Becomes([this] { return !IsOpen(); }));
  EXPECT_THAT(Listed(), ElementsAre(kMapName));
  const EngineNumbers numbers = NumbersOf(db());
  ASSERT_EQ(numbers.maps.size(), 1U);
  EXPECT_EQ(numbers.maps[0].scans, 3U);
  EXPECT_GT(numbers.maps[0].commits, 3U);
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats after, db().maps().Stats({}, kMapName));
  EXPECT_EQ(after.content_digest, before.content_digest);
  EXPECT_EQ(after.commit_sequence, before.commit_sequence);
  EXPECT_EQ(AllTiles(db()), tiles);
  UploadRoom(4, RoomPose(4));
  WaitIntegrated(db());
  EXPECT_GT(NumbersOf(db()).maps[0].commits, numbers.maps[0].commits);
}

TEST_F(OpenMapsTest, ItLooksAgainAndAgain) {
  EngineOptions options = Idle(absl::ZeroDuration());
  options.look_interval = absl::ZeroDuration();
  EXPECT_THAT(OpenEngine(options),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       HasSubstr("look_interval = 0 is not above zero")));
}

// Whoever watches or sends holds it.
TEST_F(OpenMapsTest, WhatIsInUseStaysOpen) {
  Reopen(Idle(absl::ZeroDuration()));
  MakeMap();
  Stop stop;
  api::Call call;
  call.stop = stop;
  std::thread watch([&] {
    db().maps()
        .Watch(call, kMapName, {}, [](const api::MapUpdate&) { return absl::OkStatus(); })
        .IgnoreError();
  });
  EXPECT_TRUE(Becomes([this] { return IsOpen(); }));
  absl::SleepFor(absl::Milliseconds(500));  // ten looks
  EXPECT_TRUE(IsOpen());
  stop.Request();
  watch.join();
  EXPECT_TRUE(Becomes([this] { return !IsOpen(); }));
  const PointCloud cloud = MakeRoom(1);
  STRATA_ASSERT_OK_AND_ASSIGN(
      auto upload, db().scans().Upload({}, kMapName, HeaderOf({"run", 1}, cloud, PoseAt(0, 0))));
  STRATA_ASSERT_OK(upload->Write(cloud));
  absl::SleepFor(absl::Milliseconds(500));  // ten looks
  EXPECT_TRUE(IsOpen());
  STRATA_EXPECT_OK(upload->Finish());
  upload.reset();
  EXPECT_TRUE(Becomes([this] { return !IsOpen(); }));
  EXPECT_EQ(WaitIntegrated(db()).scans, 1U);
}

TEST_F(OpenMapsTest, WhatHasWorkLeftGoesOnAfterARestart) {
  for (const char* map : {"scans", "jobs", "rebuilt", "rest"}) {
    MakeMap(SmallMap(), map);
    UploadRooms(2, map);
    WaitIntegrated(db(), map);
  }
  Close();
  Sql("UPDATE truth_scan SET state = 1 WHERE number = (SELECT max(number) FROM truth_scan); DELETE "
      "FROM derived_scan_tile; UPDATE derived_state SET complete = 0",
      "scans");
  Sql("INSERT INTO truth_job VALUES (1, 'verify', 1, 0, '', '', 0, 0)", "jobs");
  Sql("UPDATE derived_state SET schema = 0", "rebuilt");
  Reopen(Idle(absl::ZeroDuration()));
  const auto of = [this](const std::string& name) {
    for (const MapNumbers& map : NumbersOf(db()).maps) {
      if (map.map == name) return map;
    }
    return MapNumbers();
  };
  EXPECT_TRUE(Becomes([&] { return of("jobs").jobs.contains({"verify", JobState::kSucceeded}); }));
  EXPECT_TRUE(Becomes([&] { return of("scans").scans_pending == 0 && of("scans").scans == 2; }));
  EXPECT_TRUE(Becomes([&] { return of("rebuilt").tiles > 0; }));
  for (const char* map : {"scans", "jobs", "rebuilt"}) {
    EXPECT_TRUE(Becomes([&] { return !IsOpen(map); })) << map;
  }
  EXPECT_FALSE(IsOpen("rest"));
}

TEST_F(OpenMapsTest, AMapThatWasKilledIsLookedAtAfterTheRestart) {
  MakeMap();
  UploadRooms(2);
  WaitIntegrated(db());
  const TempDir copies;  // as a kill leaves the files
  for (const char* suffix : {"", "-wal"}) {
    fs::copy_file(MapFile().string() + suffix, copies.path() / absl::StrCat("copy", suffix));
  }
  Close();
  for (const char* suffix : {"", "-wal"}) {
    fs::copy_file(copies.path() / absl::StrCat("copy", suffix),
                  MapFile().string() + suffix,
                  fs::copy_options::overwrite_existing);
  }
  Reopen(Idle(absl::ZeroDuration()));
  EXPECT_TRUE(Becomes([this] {
    const EngineNumbers numbers = NumbersOf(db());
    return numbers.maps.size() == 1 && numbers.maps[0].scans == 2 && !IsOpen();
  }));
}

TEST_F(OpenMapsTest, NoMoreAreOpenThanMayBe) {
  EngineOptions options = Idle(absl::Hours(1));
  options.max_open_maps = 2;
  Reopen(options);
  for (int i = 0; i < 5; ++i) {
    MakeMap(SmallMap(), absl::StrCat("map", i));
    UploadRoom(1, PoseAt(0, 0), absl::StrCat("map", i));
    WaitIntegrated(db(), absl::StrCat("map", i));
  }
  const auto open = [this] {
    int count = 0;
    for (int i = 0; i < 5; ++i) count += IsOpen(absl::StrCat("map", i)) ? 1 : 0;
    return count;
  };
  EXPECT_EQ(open(), 2);
  // All at once: each has its turn, or is told to come again.
  std::vector<std::thread> robots;
  for (int i = 0; i < 5; ++i) {
    robots.emplace_back([&, i] {
      const PointCloud cloud = MakeRoom(2);
      const ScanHeader header = HeaderOf({"run", 2}, cloud, PoseAt(1, 0));
      absl::Status put;
      for (int attempt = 0; attempt < 1000; ++attempt) {
        put = Upload(db(), header, cloud, 2000, absl::StrCat("map", i)).status();
        if (!absl::IsResourceExhausted(put)) break;
        EXPECT_THAT(put.message(), HasSubstr("all are in use"));
        absl::SleepFor(absl::Milliseconds(10));
      }
      STRATA_EXPECT_OK(put);
    });
  }
  for (std::thread& robot : robots) robot.join();
  EXPECT_LE(open(), 2);
  EXPECT_EQ(Listed().size(), 5U);
  for (int i = 0; i < 5; ++i) {
    absl::StatusOr<MapStats> stats = absl::ResourceExhaustedError("");
    EXPECT_TRUE(Becomes([&] {
      stats = db().maps().Stats({}, absl::StrCat("map", i));
      return stats.ok() && stats->scans_pending == 0;
    }));
    EXPECT_EQ(stats->scans, 2U) << i;
  }
}

TEST_F(OpenMapsTest, AMapThatIsClosedIsDeletedAndItsClockRemembered) {
  MakeMap();
  UploadRooms(3);
  const std::uint64_t clock = WaitIntegrated(db()).commit_sequence;
  Close();
  Reopen();
  STRATA_ASSERT_OK(db().maps().Delete({}, kMapName));
  EXPECT_THAT(Listed(), IsEmpty());
  EXPECT_THAT(db().maps().Get({}, kMapName), StatusIs(absl::StatusCode::kNotFound, _));
  MakeMap();
  EXPECT_GT(WaitIntegrated(db()).commit_sequence, clock);
}

TEST_F(OpenMapsTest, ADamagedMapIsSaidWithoutBeingAskedFor) {
  MakeMap();
  MakeMap(SmallMap(), "other");
  Close();
  Sql("DROP TABLE truth_map");
  Reopen();
  EXPECT_TRUE(Becomes([this] { return !HealthOf(db()).maps_not_opened.empty(); }));
  EXPECT_THAT(HealthOf(db()).maps_not_opened, ElementsAre(kMapName));
  EXPECT_EQ(NumbersOf(db()).maps_not_opened, 1U);
  EXPECT_THAT(Listed(), ElementsAre("other"));
}

// The order of calls, openings and closings is the threads' own.
TEST_F(OpenMapsTest, ManyWhoUseAndMakeAndDeleteMapsAtOnce) {
  EngineOptions options = Idle(absl::ZeroDuration());
  options.max_open_maps = 3;
  Reopen(options);
  std::vector<std::thread> robots;
  for (int robot = 0; robot < 4; ++robot) {
    robots.emplace_back([&, robot] {
      const std::string own = absl::StrCat("own", robot);
      const PointCloud cloud = MakeRoom(static_cast<std::uint64_t>(robot), 300);
      for (std::uint64_t round = 1; round <= 10; ++round) {
        const auto made = db().maps().Create({}, own, SmallMap());
        EXPECT_THAT(made, IsOk());
        const ScanHeader header = HeaderOf({"run", round}, cloud, PoseAt(0, 0));
        absl::Status put = absl::ResourceExhaustedError("");
        while (absl::IsResourceExhausted(put) || absl::IsUnavailable(put)) {
          put = Upload(db(), header, cloud, 2000, own).status();
        }
        STRATA_EXPECT_OK(put);
        absl::Status gone = absl::ResourceExhaustedError("");
        while (absl::IsResourceExhausted(gone)) gone = db().maps().Delete({}, own);
        STRATA_EXPECT_OK(gone);
      }
    });
  }
  for (std::thread& robot : robots) robot.join();
  EXPECT_THAT(Listed(), IsEmpty());
}

}  // namespace
}  // namespace strata::testing
