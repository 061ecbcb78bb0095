// Servers that share a database of the test's own, for tests of what one does beside the other.
#ifndef STRATA_TESTS_INTEGRATION_CLUSTER_SHARING_SERVERS_H_
#define STRATA_TESTS_INTEGRATION_CLUSTER_SHARING_SERVERS_H_

#include <csignal>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "core/api/database.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "tests/integration/numbered_scans.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/patience.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {

inline constexpr char kShared[] = "shared";

class SharingServer {
 public:
  // `more`: arguments.
  SharingServer(std::string name, std::string store, std::vector<std::string> more = {})
      : name_(std::move(name)), store_(std::move(store)), more_(std::move(more)) {}

  // From its next start on its name is its address.
  void NameByAddress() {
    listen_ = process_->Address();
    name_ = listen_;
  }
  void Start() {
    std::vector<std::string> arguments = {"--data",
                                          data_.path().string(),
                                          "--listen",
                                          listen_,
                                          "--store",
                                          store_,
                                          "--map-lease",
                                          "1",
                                          "--server-name",
                                          name_,
                                          "--optimize-every",
                                          "0"};
    arguments.insert(arguments.end(), more_.begin(), more_.end());
    process_ = std::make_unique<StratadProcess>(arguments);
    ClientOptions options;
    options.target = process_->Address();
    options.backoff.max_attempts = 1;  // whoever asks goes to another server
    auto connected = Connect(options);
    STRATA_ASSERT_OK(connected);
    absl::MutexLock lock(&mutex_);
    db_ = *std::move(connected);
  }
  void Kill() {
    process_->Signal(SIGKILL);
    process_->Wait();
  }
  void Signal(int signal) { process_->Signal(signal); }
  void Await() { process_->Wait(); }
  const std::string& address() { return process_->Address(); }
  std::shared_ptr<api::Database> db() {
    absl::MutexLock lock(&mutex_);
    return db_;
  }

 private:
  std::string name_;
  std::string listen_ = "127.0.0.1:0";
  const std::string store_;
  const std::vector<std::string> more_;
  const TempDir data_;
  std::unique_ptr<StratadProcess> process_;
  absl::Mutex mutex_;
  std::shared_ptr<api::Database> db_;
};

// Two servers, a and b, of which a has the empty map kShared.
class SharingServersTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto cluster = SharedPostgresCluster();
    if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
    STRATA_ASSERT_OK(cluster);
    store_ =
        (*cluster)->AddressOfOwn(::testing::UnitTest::GetInstance()->current_test_info()->name());
    for (const char* name : {"a", "b"}) {
      servers_.push_back(std::make_unique<SharingServer>(name, store_));
      servers_.back()->Start();
    }
    STRATA_ASSERT_OK(servers_[0]->db()->maps().Create({}, kShared, MapParameters()));
  }
  api::Database& db(std::size_t server) {
    held_.push_back(servers_[server]->db());
    return *held_.back();
  }
  // Until `call` is not refused for who asks whom any more.
  static absl::Status Insist(const std::function<absl::Status()>& call) {
    const absl::Time end = absl::Now() + kPatience;
    while (true) {
      absl::Status done = call();
      const bool again =
          absl::IsUnavailable(done) || absl::IsDeadlineExceeded(done) || absl::IsCancelled(done);
      if (!again || absl::Now() >= end) return done;
      absl::SleepFor(absl::Milliseconds(20));
    }
  }

  std::string store_;
  std::vector<std::unique_ptr<SharingServer>> servers_;
  std::vector<std::shared_ptr<api::Database>> held_;
};

inline constexpr std::size_t kNumberedPoints = 100;

// The scan of that number; a call that lasts no longer than four seconds.
inline absl::StatusOr<ScanAck> PutNumbered(api::Database& db,
                                           const char* map,
                                           std::uint64_t sequence) {
  api::Call call;
  call.stop = Stop(SteadyNow() + absl::Seconds(4));
  const PointCloud cloud = NumberedCloud(sequence, kNumberedPoints);
  STRATA_ASSIGN_OR_RETURN(const auto upload,
                          db.scans().Upload(call, map, NumberedHeader(sequence, cloud)));
  if (upload->points_held() < cloud.size()) STRATA_RETURN_IF_ERROR(upload->Write(cloud));
  return upload->Finish();
}

// For tiles of an epoch that never was, which only the server that has the map can say: OK if this
// one has it.
inline absl::Status AskTheOwner(api::Database& db, const char* map) {
  api::TileArea area;
  area.epoch = 1'000'000;
  const absl::Status asked = db.tiles().List({}, map, area).status();
  return absl::IsNotFound(asked) ? absl::OkStatus() : asked;
}

// Once no scan of the map is pending.
inline absl::StatusOr<MapStats> AtRest(api::Database& db, const char* map) {
  while (true) {
    STRATA_ASSIGN_OR_RETURN(MapStats stats, db.maps().Stats({}, map));
    if (stats.scans_pending == 0) return stats;
    absl::SleepFor(absl::Milliseconds(20));
  }
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_CLUSTER_SHARING_SERVERS_H_
