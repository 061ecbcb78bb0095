// An optimize job whose server is killed at random moments, while a robot uploads and a client
// reads.
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <set>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/sdk/client.h"
#include "tests/integration/cli_fixture.h"
#include "tests/support/simulator.h"

namespace strata::testing {
namespace {

using nlohmann::json;

// Of the random moments; STRATA_KILLS asks for more of them than a test has time for.
constexpr std::uint64_t kSeed = 20261122;
int Kills() {
  const char* asked = std::getenv("STRATA_KILLS");
  return asked == nullptr ? 4 : std::atoi(asked);
}

class OptimizeCrashTest : public CliTest {
 protected:
  void SetUp() override {
    StartServer();
    Json({"map", "create", "m"});
    RobotFiles files;
    files.step_m = 2.0;
    files.sensor.columns = 720;
    over_ = WriteDrive("over", files);
    under_ = WriteDrive("under", files);
    EXPECT_EQ(Json(ImportArguments("m", "over")).at("integrated"), over_);
  }
  // Says that a scan is somewhere else, so that there is something to do.
  void Push(int round) {
    const json pose = Json({"pose", "lookup", "m", "over/1"}).at("pose");
    const std::string at = absl::StrCat(pose[0].get<double>() + 0.2 * (round % 2 == 0 ? 1 : -1),
                                        ",",
                                        pose[1].get<double>(),
                                        ",",
                                        pose[2].get<double>(),
                                        ",0");
    Json({"posegraph", "add-constraint", "m", "map", "over/1", "--pose", at, "--sigma-m", "0.01"});
  }
  json Job(std::uint64_t id) { return Json({"job", "show", "m", absl::StrCat(id)}); }

  std::uint64_t over_ = 0;
  std::uint64_t under_ = 0;
};

// Fetches everything over and over: an answer is of one epoch.
class Reader {
 public:
  explicit Reader(std::string address)
      : address_(std::move(address)), thread_([this] { Loop(); }) {}
  ~Reader() {
    stop_ = true;
    thread_.join();
  }

 private:
  void Loop() {
    ClientOptions options;
    options.target = address_;
    const auto database = Connect(options);
    while (!stop_ && database.ok()) {
      std::set<std::uint64_t> epochs;
      const absl::Status read =
          (*database)->tiles().Fetch({}, "m", {}, {}, [&](const api::TileUpdate& update) {
            epochs.insert(update.tile.epoch);
            return absl::OkStatus();
          });
      EXPECT_LE(epochs.size(), 1U) << read;
    }
  }

  const std::string address_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

TEST_F(OptimizeCrashTest, TheJobEndsAfterEveryRestartAndTheWorldIsWhole) {
  Random random(kSeed);
  SCOPED_TRACE(absl::StrCat("seed ", kSeed));
  std::thread upload([&] { Json(ImportArguments("m", "under")); });
  for (int round = 0; round < Kills(); ++round) {
    Push(round);
    const std::uint64_t id = Json({"job", "start", "m", "optimize", "rounds=2"}).at("id");
    {
      const Reader reader(server().Address());
      absl::SleepFor(absl::Milliseconds(random.Uniform(0.0, 2500.0)));
      server().Signal(SIGKILL);
      EXPECT_EQ(server().Wait(), -SIGKILL);
    }
    StartServer();
    Json({"job", "watch", "m", absl::StrCat(id)});
    EXPECT_EQ(Job(id).at("state"), "succeeded") << Job(id);
  }
  upload.join();
  const json shown = Json({"map", "show", "m"});
  EXPECT_EQ(shown.at("scans"), over_ + under_);
  EXPECT_EQ(shown.at("scans_failed"), 0);
  EXPECT_GT(shown.at("epoch").get<std::uint64_t>(), 1U);
  EXPECT_EQ(Json({"map", "verify", "m"}).at("state"), "succeeded");
  const std::string digest = shown.at("content_digest");
  EXPECT_EQ(Json({"map", "rebuild", "m"}).at("state"), "succeeded");
  EXPECT_EQ(Json({"map", "show", "m"}).at("content_digest"), digest);
}

}  // namespace
}  // namespace strata::testing
