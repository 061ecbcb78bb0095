// Somebody takes the files of an open map away.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <ostream>
#include <string>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/engine/map/numbers.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::_;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Hand {
  std::string name;
  std::function<void(const fs::path&)> take;
};
void PrintTo(const Hand& hand, std::ostream* out) { *out << hand.name; }

fs::path LogOf(const fs::path& file) { return file.string() + "-wal"; }

class TakenFilesTest : public EngineTest, public ::testing::WithParamInterface<Hand> {
 protected:
  absl::Status Put(std::uint64_t sequence) {
    const PointCloud cloud = MakeRoom(sequence, 500);
    return Upload(db(), HeaderOf({"run", sequence}, cloud, PoseAt(0, 0)), cloud).status();
  }
};

TEST_P(TakenFilesTest, NothingMoreIsAcknowledged) {
  MakeMap();
  MakeMap(SmallMap(), "other");
  UploadRoom(1, PoseAt(0, 0), "other");
  STRATA_ASSERT_OK(Put(1));
  WaitIntegrated(db());
  GetParam().take(MapFile());
  EXPECT_THAT(Put(2), StatusIs(absl::StatusCode::kUnavailable, HasSubstr("put the file back")));
  EXPECT_THAT(Put(3), StatusIs(absl::StatusCode::kUnavailable, _));
  EXPECT_THAT(db().posegraph().SetPose({}, kMapName, {"run", 1}, PoseAt(1, 0)),
              StatusIs(absl::StatusCode::kUnavailable, _));
  // Other maps are none of it.
  UploadRoom(2, PoseAt(0, 0), "other");
}

INSTANTIATE_TEST_SUITE_P(
    Hands,
    TakenFilesTest,
    ::testing::Values(
        Hand{"removes the file", [](const fs::path& file) { fs::remove(file); }},
        Hand{"moves the file",
             [](const fs::path& file) { fs::rename(file, file.string() + ".old"); }},
        Hand{"puts another in its place",
             [](const fs::path& file) {
               fs::copy_file(file, file.string() + ".new");
               fs::rename(file.string() + ".new", file);
             }},
        Hand{"cuts the file",
             [](const fs::path& file) { fs::resize_file(file, fs::file_size(file) / 2); }},
        Hand{"removes the log", [](const fs::path& file) { fs::remove(LogOf(file)); }},
        Hand{"cuts the log", [](const fs::path& file) { fs::resize_file(LogOf(file), 0); }}));

// Said without anybody writing anything.
TEST_F(EngineTest, WhoWatchesIsToldOfAFileThatWasTakenAwayUntilItIsBack) {
  MakeMap();
  MakeMap(SmallMap(), "other");
  const fs::path away = MapFile().string() + ".old";
  EXPECT_THAT(HealthOf(db()).maps_taken_away, IsEmpty());
  fs::rename(MapFile(), away);
  EXPECT_THAT(HealthOf(db()).maps_taken_away,
              ElementsAre(AllOf(HasSubstr("world: "), HasSubstr("put the file back"))));
  EXPECT_THAT(HealthOf(db()).maps_not_written, IsEmpty());
  fs::copy_file(away, MapFile());
  EXPECT_THAT(HealthOf(db()).maps_taken_away, ElementsAre(HasSubstr("world: ")));
  fs::rename(away, MapFile());
  EXPECT_THAT(HealthOf(db()).maps_taken_away, IsEmpty());
}

TEST_F(EngineTest, WhoWatchesIsToldOfAFileThatWasCut) {
  MakeMap();
  EXPECT_THAT(HealthOf(db()).maps_taken_away, IsEmpty());
  fs::resize_file(MapFile(), fs::file_size(MapFile()) / 2);
  EXPECT_THAT(HealthOf(db()).maps_taken_away, ElementsAre(HasSubstr("world: ")));
}

TEST_F(EngineTest, AFileThatWasPutBackIsGoneOnWith) {
  MakeMap();
  UploadRoom(1, PoseAt(0, 0));
  WaitIntegrated(db());
  fs::rename(MapFile(), MapFile().string() + ".old");
  const PointCloud cloud = MakeRoom(2, 500);
  const ScanHeader header = HeaderOf({"run", 2}, cloud, PoseAt(0, 0));
  EXPECT_THAT(Upload(db(), header, cloud).status(),
              StatusIs(absl::StatusCode::kUnavailable, HasSubstr("put the file back")));
  fs::rename(MapFile().string() + ".old", MapFile());
  STRATA_EXPECT_OK(Upload(db(), header, cloud));
  EXPECT_EQ(WaitIntegrated(db()).scans, 2U);
  ExpectSound();
}

}  // namespace
}  // namespace strata::testing
