#include "server/readiness.h"

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/api/database.h"
#include "core/engine/engine.h"
#include "core/world/map_info.h"
#include "server/server.h"
#include "tests/server/raw_call.h"
#include "tests/server/served_mock.h"
#include "tests/support/patience.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::server {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

// A hang, not a slow machine.

// What was told, in order.
class Told {
 public:
  void Add(bool ready) {
    absl::MutexLock lock(&mutex_);
    told_.push_back(ready);
  }
  // Once it was told `times` times.
  std::vector<bool> Await(std::size_t times) {
    absl::MutexLock lock(&mutex_);
    const auto enough = [&]()
                            ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return told_.size() >= times; };
    mutex_.AwaitWithTimeout(absl::Condition(&enough), testing::kPatience);
    return told_;
  }

 private:
  absl::Mutex mutex_;
  std::vector<bool> told_ ABSL_GUARDED_BY(mutex_);
};

TEST(ReadinessTest, TellsEachChangeOnce) {
  std::atomic<bool> full = false;
  Told told;
  const Readiness readiness(
      {{"disk", [&full] { return full ? "full" : ""; }}, {"log", [] { return ""; }}},
      absl::Milliseconds(1),
      [&told](bool ready) { told.Add(ready); });
  EXPECT_THAT(told.Await(1), ElementsAre(true));
  full = true;
  EXPECT_THAT(told.Await(2), ElementsAre(true, false));
  EXPECT_THAT(readiness.state(), ElementsAre(Pair("disk", "full"), Pair("log", "")));
  full = false;
  EXPECT_THAT(told.Await(3), ElementsAre(true, false, true));
  EXPECT_THAT(readiness.state(), ElementsAre(Pair("disk", ""), Pair("log", "")));
}

class ReadyServerTest : public ServedMock {
 protected:
  std::string Health(const std::string& service) {
    const std::string request =
        service.empty() ? "" : std::string("\x0A") + static_cast<char>(service.size()) + service;
    const RawAnswer answer = CallRaw(channel_, "/grpc.health.v1.Health/Check", request);
    if (!answer.status.ok() || answer.messages.empty()) return answer.status.error_message();
    return answer.messages.front() == std::string("\x08\x01", 2) ? "SERVING" : "NOT_SERVING";
  }
  void Start(api::Database& db, std::vector<ReadinessCheck> checks) {
    ServerOptions options;
    options.listen = "127.0.0.1:0";
    STRATA_ASSERT_OK_AND_ASSIGN(server_, Server::Start(db, options, std::move(checks)));
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
  }
  // What a service's health is at last.
  std::string Await(const std::string& state) {
    const absl::Time until = absl::Now() + testing::kPatience;
    while (Health("strata.v1.Scans") != state && absl::Now() < until) {
      absl::SleepFor(absl::Milliseconds(10));
    }
    return Health("strata.v1.Scans");
  }
};

TEST_F(ReadyServerTest, WhatKeepsTheServerFromItsWorkIsNotItsDeath) {
  std::atomic<bool> full = true;
  Start(db_, {{"log", [&full] { return full ? "full" : ""; }}});
  EXPECT_EQ(Health("strata.v1.Scans"), "NOT_SERVING");
  EXPECT_EQ(Health(""), "SERVING");
  EXPECT_EQ(Health("liveness"), "SERVING");
  full = false;
  EXPECT_EQ(Await("SERVING"), "SERVING");
  server_.reset();
}

TEST_F(ReadyServerTest, AMapWhoseFileIsTakenAwayKeepsItFromItsWorkUntilItIsBack) {
  const testing::TempDir directory;
  EngineOptions options;
  options.directory = directory.path();
  STRATA_ASSERT_OK_AND_ASSIGN(const auto engine, OpenEngine(options));
  STRATA_ASSERT_OK(engine->maps().Create({}, "campus", MapParameters()));
  Start(*engine, {});
  EXPECT_EQ(Health("strata.v1.Scans"), "SERVING");
  const std::filesystem::path file = directory.path() / "campus.strata";
  const std::filesystem::path away = directory.path() / "away";
  std::filesystem::rename(file, away);
  EXPECT_EQ(Await("NOT_SERVING"), "NOT_SERVING");
  EXPECT_EQ(Health("liveness"), "SERVING");
  std::filesystem::rename(away, file);
  EXPECT_EQ(Await("SERVING"), "SERVING");
  server_.reset();
}

}  // namespace
}  // namespace strata::server
