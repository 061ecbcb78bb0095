// `strata scan import` while its server is killed under it.
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/sdk/client.h"
#include "tests/integration/cli/cli_fixture.h"
#include "tests/support/simulator/robot_files.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using nlohmann::json;

constexpr char kRobot[] = "over";

class ImportTest : public CliTest {
 protected:
  // 21 scans of two chunks each.
  static void SetUpTestSuite() {
    drive_ = new TempDir;
    RobotFiles files;
    files.step_m = 3.0;
    files.sensor.columns = 1440;
    scans_ = WriteDriveTo((drive_->path() / kRobot).string(), kRobot, files);
  }
  static void TearDownTestSuite() {
    delete drive_;
    drive_ = nullptr;
  }
  void SetUp() override {
    std::filesystem::create_directory_symlink(drive_->path() / kRobot, Path(kRobot));
  }

  json Import() { return Json(ImportArguments("m", kRobot)); }
  json Show() { return Json({"map", "show", "m"}); }

  // Returns how many scans the server has acknowledged, once they are `scans`.
  std::uint64_t AwaitCommitted(std::uint64_t scans) {
    ClientOptions options;
    options.target = server().Address();
    const auto database = Connect(options);
    EXPECT_THAT(database, IsOk());
    while (database.ok()) {
      const auto state = (*database)->scans().GetUploadState({}, "m", kRobot);
      EXPECT_THAT(state, IsOk());
      if (!state.ok() || state->scans >= scans) return state.value_or(UploadState()).scans;
      absl::SleepFor(absl::Milliseconds(2));
    }
    return 0;
  }
  // Kills the server and starts it again after `pause`; what it acknowledged before is there.
  void KillAndRestart(std::uint64_t acknowledged, absl::Duration pause) {
    server().Signal(SIGKILL);
    EXPECT_EQ(server().Wait(), -SIGKILL);
    absl::SleepFor(pause);
    StartServer("disturbed");
    EXPECT_GE(AwaitCommitted(0), acknowledged);
  }

  static inline TempDir* drive_ = nullptr;
  static inline std::uint64_t scans_ = 0;
};

TEST_F(ImportTest, ResumesByItselfWhenTheServerIsKilledAndComesBack) {
  StartServer("undisturbed");
  Json({"map", "create", "m"});
  EXPECT_EQ(Import().at("integrated"), scans_);
  const json undisturbed = Show();

  StartServer("disturbed");
  Json({"map", "create", "m"});
  json summary;
  std::thread import([&] { summary = Import(); });
  KillAndRestart(AwaitCommitted(scans_ / 5), absl::Seconds(6));
  KillAndRestart(AwaitCommitted(scans_ / 2), absl::ZeroDuration());
  KillAndRestart(AwaitCommitted(scans_), absl::Seconds(6));  // it waits for the integration
  import.join();
  EXPECT_EQ(summary.at("uploaded"), scans_) << summary;
  EXPECT_EQ(summary.at("skipped"), 0);
  EXPECT_EQ(summary.at("failed"), 0);
  EXPECT_EQ(summary.at("integrated"), scans_);

  EXPECT_EQ(Json({"map", "verify", "m"}).at("state"), "succeeded");
  const json disturbed = Show();
  EXPECT_EQ(disturbed.at("content_digest"), undisturbed.at("content_digest"));
  EXPECT_EQ(disturbed.at("points"), undisturbed.at("points"));
  const json again = Import();
  EXPECT_EQ(again.at("uploaded"), 0);
  EXPECT_EQ(again.at("skipped"), scans_);
}

TEST_F(ImportTest, GoesOnWhereAnEarlierCallEnded) {
  StartServer();
  Json({"map", "create", "m"});
  Import();
  const std::string digest = Show().at("content_digest");
  for (const std::uint64_t sequence : {std::uint64_t{0}, scans_ / 2, scans_ - 1}) {
    Json({"scan", "delete", "m", std::string(kRobot) + "/" + std::to_string(sequence)});
  }
  const json summary = Import();
  EXPECT_EQ(summary.at("uploaded"), 3);
  EXPECT_EQ(summary.at("skipped"), scans_ - 3);
  EXPECT_EQ(Show().at("content_digest"), digest);
}

// A map that drops points is the same whoever made the local maps.
TEST_F(ImportTest, LocalMapsMadeHereMakeTheSameMapOfFewerBytes) {
  StartServer();
  Json({"map", "create", "points", "--drop-points"});
  Json({"map", "create", "m", "--drop-points"});
  const json points = Json(ImportArguments("points", kRobot));
  std::vector<std::string> arguments = ImportArguments("m", kRobot);
  arguments.push_back("--local-maps");
  const json local_maps = Json(arguments);
  EXPECT_EQ(local_maps.at("integrated"), scans_);
  EXPECT_EQ(local_maps.at("points"), points.at("points"));
  EXPECT_LT(local_maps.at("local_map_bytes"), 12 * points.at("points").get<std::uint64_t>());
  EXPECT_EQ(Show().at("content_digest"), Json({"map", "show", "points"}).at("content_digest"));
  EXPECT_EQ(Json({"map", "verify", "m"}).at("state"), "succeeded");
  EXPECT_EQ(Json(arguments).at("skipped"), scans_);
}

TEST_F(ImportTest, ASpoolKeepsTheScansOfAServerThatIsAway) {
  StartServer();
  Json({"map", "create", "m"});
  server().Signal(SIGKILL);
  server().Wait();
  const std::string spool = Path("spool");
  std::vector<std::string> arguments = ImportArguments("m", kRobot);
  arguments.pop_back();  // --wait
  arguments.insert(arguments.end(), {"--spool", spool});
  const json away = Json(arguments);
  EXPECT_EQ(away.at("added"), scans_);
  EXPECT_EQ(away.at("sent"), 0);
  EXPECT_EQ(away.at("waiting"), scans_);
  EXPECT_EQ(Json({"spool", "status", spool}).at("waiting"), scans_);
  EXPECT_EQ(Run({"spool", "send", spool}).exit_code, 1);
  EXPECT_EQ(Json(arguments).at("added"), 0);  // they wait already

  StartServer();
  const json sent = Json({"spool", "send", spool});
  EXPECT_EQ(sent.at("sent"), scans_);
  EXPECT_EQ(sent.at("waiting"), 0);
  EXPECT_EQ(Json(arguments).at("sent"), scans_);  // and once more, which changes nothing
  EXPECT_EQ(Import().at("skipped"), scans_);
  EXPECT_EQ(Show().at("scans"), scans_);
}

}  // namespace
}  // namespace strata::testing
