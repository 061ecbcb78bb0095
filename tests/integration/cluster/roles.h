// Servers of one database with roles of their own.
#ifndef STRATA_TESTS_INTEGRATION_CLUSTER_ROLES_H_
#define STRATA_TESTS_INTEGRATION_CLUSTER_ROLES_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>

#include "core/api/database.h"
#include "core/cloud/point_cloud.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "core/storage/postgresql/connection.h"
#include "core/world/job.h"
#include "tests/integration/cluster/sharing_servers.h"
#include "tests/integration/numbered_scans.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {

inline constexpr std::uint16_t kThing = 2;

inline api::Call Within(absl::Duration patience) {
  api::Call call;
  call.stop = Stop(SteadyNow() + patience);
  return call;
}

inline absl::Status SetX(api::Database& db, std::uint64_t sequence, double x_m) {
  Pose pose = Pose::Identity();
  pose.translation().x() = x_m;
  return db.posegraph().SetPose(Within(kPatience), kShared, {"run", sequence}, pose);
}

inline absl::Status RunJobOf(api::Database& db, const char* kind) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, db.jobs().Start({}, kShared, kind, {}));
  JobInfo last;
  STRATA_RETURN_IF_ERROR(
      db.jobs().Watch(Within(kPatience), kShared, job.id, [&last](const JobInfo& now) {
        last = now;
        return absl::OkStatus();
      }));
  return last.state == JobState::kSucceeded ? absl::OkStatus() : absl::InternalError(last.message);
}

// In pieces.
inline absl::Status Write(api::ScanUpload& upload,
                          const PointCloud& cloud,
                          std::size_t begin,
                          std::size_t end) {
  constexpr std::size_t kPiece = 40'000;
  for (; begin < end; begin += kPiece) {
    PointCloud piece;
    const auto at = [&](std::size_t point) {
      return cloud.points.begin() + static_cast<std::ptrdiff_t>(std::min(point, end));
    };
    piece.points.assign(at(begin), at(begin + kPiece));
    if (!cloud.label.empty()) piece.label.assign(piece.size(), cloud.label.front());
    STRATA_RETURN_IF_ERROR(upload.Write(piece));
  }
  return absl::OkStatus();
}

// Server a is a gateway, b, c … are started by the tests.
class RolesTest : public SharingServersTest {
 protected:
  void SetUp() override {
    const auto cluster = SharedPostgresCluster();
    if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
    STRATA_ASSERT_OK(cluster);
    store_ =
        (*cluster)->AddressOfOwn(::testing::UnitTest::GetInstance()->current_test_info()->name());
    Add("a", "gateway");
  }
  void Add(const char* name, const char* roles) {
    servers_.push_back(
        std::make_unique<SharingServer>(name, store_, std::vector<std::string>{"--role", roles}));
    servers_.back()->Start();
  }
  // As the database has it: "SELECT ….", one value.
  std::string Ask(const char* sql) {
    const auto connection = Connection::Open(store_);
    if (!connection.ok()) return "";
    auto row = (*connection)->Query(sql);
    return row.ok() && row->Next() ? row->Text(0) : "";
  }
  // Who runs a job of a map that another has.
  std::string RunBy() { return Ask("SELECT value FROM truth_job_parameter WHERE name = 'run_by'"); }
  // Scans that a job has seconds of work with, of one class.
  void PutLargeScans(std::size_t points = 200'000) {
    for (std::uint64_t scan = 1; scan <= 2; ++scan) {
      PointCloud cloud = NumberedCloud(scan, points);
      cloud.label.assign(cloud.size(), kThing);
      STRATA_ASSERT_OK_AND_ASSIGN(const auto upload,
                                  db(0).scans().Upload({}, kShared, NumberedHeader(scan, cloud)));
      STRATA_ASSERT_OK(Write(*upload, cloud, 0, cloud.size()));
      STRATA_ASSERT_OK(upload->Finish());
    }
    STRATA_ASSERT_OK(AtRest(db(0), kShared));
  }
  JobInfo Started(const char* kind, const JobParameters& parameters = {}) {
    const auto job = db(0).jobs().Start({}, kShared, kind, parameters);
    STRATA_EXPECT_OK(job);
    return job.value_or(JobInfo());
  }
  JobInfo Ended(std::uint64_t id) {
    JobInfo last;
    STRATA_EXPECT_OK(
        db(0).jobs().Watch(Within(kPatience), kShared, id, [&last](const JobInfo& now) {
          last = now;
          return absl::OkStatus();
        }));
    return last;
  }
  // Until somebody else than `before` runs one.
  std::string AwaitRun(const std::string& before = "") {
    std::string now;
    STRATA_EXPECT_OK(Insist([&] {
      now = RunBy();
      return now.empty() || now == before ? absl::UnavailableError("nobody") : absl::OkStatus();
    }));
    return now;
  }
  // Of the map kShared, if anybody.
  std::string Owner() {
    return Ask("SELECT server FROM map_lease WHERE expires > clock_timestamp()");
  }
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_CLUSTER_ROLES_H_
