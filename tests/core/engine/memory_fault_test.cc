// An allocation that fails anywhere ends the work it was for, and nothing else: no process, nothing
// that was acknowledged, and no tile that would not follow from its scans.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/api/scans.h"
#include "core/cloud/cloud_slice.h"
#include "core/common/cache_budget.h"
#include "core/common/guarded.h"
#include "core/common/hash_map.h"
#include "core/common/lru_cache.h"
#include "core/common/random.h"
#include "core/common/status.h"
#include "core/world/scan_hash.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/asked.h"
#include "tests/support/faults/failing_memory.h"
#include "tests/support/patience.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

// Takes memory wherever it is copied.
constexpr char kLong[] = "a_map_whose_name_is_longer_than_what_a_string_has_room_for";
constexpr std::size_t kPieces = 2000;

class MemoryFaultTest : public EngineTest {
 protected:
  void Put(std::uint64_t sequence) {
    Guarded([&]() -> absl::Status {
      const PointCloud cloud = MakeRoom(sequence);
      const ScanHeader header = HeaderOf({"run", sequence}, cloud, RoomPose(sequence));
      STRATA_RETURN_IF_ERROR(Upload(db(), header, cloud, kPieces, kLong).status());
      acknowledged_.insert(header.id);
      return absl::OkStatus();
    }).IgnoreError();
  }
  // Follows a job for as long as memory lasts.
  void Run(const std::string& kind, const std::map<std::string, std::string>& parameters) {
    Guarded([&]() -> absl::Status {
      const auto job = db().jobs().Start({}, kLong, kind, parameters);
      if (!job.ok()) return job.status();
      return db().jobs().Watch({}, kLong, job->id, [](const JobInfo&) { return absl::OkStatus(); });
    }).IgnoreError();
  }
  // May throw.
  void Step(int step, std::uint64_t& sequence) {
    if (step <= 1) {
      Put(++sequence);
      Put(++sequence);
      absl::SleepFor(absl::Milliseconds(20));  // integration
    }
    if (step == 2) Run("optimize", {{"rounds", "1"}});
    if (step == 3) Run("fade", {{"scans", "1"}, {"rays", "1"}});
    if (step == 4) Run("verify", {});
    if (step == 5) Run("rebuild", {});
  }
  // A map that is being opened for another call may still say that there was no memory.
  void AwaitJobs() {
    const absl::Time deadline = absl::Now() + kPatience;
    absl::Status why;
    while (absl::Now() < deadline) {
      const absl::StatusOr<std::vector<JobInfo>> jobs = db().jobs().List({}, kLong);
      why = jobs.status();
      if (jobs.ok() &&
          std::ranges::all_of(*jobs, [](const JobInfo& job) { return IsFinal(job.state); })) {
        return;
      }
      absl::SleepFor(absl::Milliseconds(5));
    }
    ADD_FAILURE() << "a job does not end, or: " << why;
  }

  std::set<ScanId> acknowledged_;
};

TEST_F(MemoryFaultTest, NothingEndsButTheWorkItWasFor) {
  const std::uint64_t rounds = Asked("STRATA_MEMORY_FAULTS", 20);
  const std::uint64_t seed = Asked("STRATA_SEED", 20261123);
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  SplitMix64 random(seed);
  EngineOptions options = Options();
  options.prepare_after = absl::Milliseconds(1);  // beside all else
  Reopen(options);
  MakeMap(SmallMap(), kLong);
  std::uint64_t sequence = 0;
  std::int64_t all_failed = 0;
  for (std::uint64_t round = 0; round < rounds; ++round) {
    // Allocations of one step are some thousands.
    const auto first = static_cast<std::int64_t>(std::pow(10.0, 5.0 * random.Uniform()));
    const auto count = static_cast<std::int64_t>(std::pow(10.0, 2.0 * random.Uniform()));
    const auto step = static_cast<int>(random.Below(6));
    {
      const FailingMemory failing(first, count);
      Guarded([&] {
        Step(step, sequence);
        return absl::OkStatus();
      }).IgnoreError();
      all_failed += failing.failed();
    }
    AwaitJobs();
    ASSERT_EQ(WaitIntegrated(db(), kLong).scans_failed, 0U);
    if (round % 10 == 9) Reopen(options);
  }
  std::cout << all_failed << " allocations failed in " << rounds << " rounds" << std::endl;
  EXPECT_GT(all_failed, static_cast<std::int64_t>(rounds) / 2);
  std::set<ScanId> there;
  STRATA_EXPECT_OK(db().scans().List({}, kLong, {}, [&there](const ScanInfo& scan) {
    there.insert(scan.header.id);
    return absl::OkStatus();
  }));
  EXPECT_THAT(there, ::testing::IsSupersetOf(acknowledged_));
  EXPECT_EQ(RunJob(db(), "verify", {}, kLong).state, JobState::kSucceeded);
  const std::string digest = WaitIntegrated(db(), kLong).content_digest;
  ASSERT_EQ(RunJob(db(), "rebuild", {}, kLong).state, JobState::kSucceeded);
  EXPECT_EQ(WaitIntegrated(db(), kLong).content_digest, digest);
}

TEST(LruCacheTest, WhatCannotBeKeptChangesNothing) {
  constexpr std::size_t kBytes = 10;
  int failed = 0;
  for (std::int64_t sound = 0; sound < 40; ++sound) {
    SCOPED_TRACE(sound);
    LruCache<int, int> cache(std::make_shared<CacheBudget>(1000), 4 * kBytes);
    {
      const FailingMemory failing(sound, 1);
      for (int i = 0; i < 8; ++i) {
        Guarded([&] {
          cache.Put(i, std::make_shared<int>(i), kBytes);
          return absl::OkStatus();
        }).IgnoreError();
      }
      failed += failing.failed() > 0 ? 1 : 0;
    }
    EXPECT_LE(cache.bytes(), 4 * kBytes);
    for (int i = 0; i < 8; ++i) cache.Put(i, std::make_shared<int>(i), kBytes);
    EXPECT_EQ(cache.bytes(), 4 * kBytes);
    for (int i = 0; i < 8; ++i) EXPECT_EQ(cache.Find(i) != nullptr, i >= 4) << i;
  }
  EXPECT_GT(failed, 20);
}

TEST(HashMapTest, OneThatCannotGrowIsWhatItWas) {
  for (std::int64_t sound = 0; sound < 200; ++sound) {
    SCOPED_TRACE(sound);
    HashMap<int, int> map;
    int put = 0;
    {
      const FailingMemory failing(sound, 1);
      Guarded([&] {
        for (; put < 1000; ++put) map[put] = put;
        return absl::OkStatus();
      }).IgnoreError();
    }
    ASSERT_EQ(map.size(), static_cast<std::size_t>(put));
    for (int i = 0; i < put; ++i) ASSERT_TRUE(map.contains(i));
    map[-1] = -1;
    EXPECT_EQ(map.size(), static_cast<std::size_t>(put) + 1);
  }
}

// What came of it is kept where there is memory for that; nobody is there to be told otherwise.
TEST_F(MemoryFaultTest, AStreamThatBreaksOffEndsNothingElse) {
  MakeMap();
  const PointCloud cloud = MakeRoom(1);
  const PointCloud half = SliceOf(cloud, 0, cloud.size() / 2);
  for (std::uint64_t sound = 0; sound < 60; ++sound) {
    SCOPED_TRACE(sound);
    ScanHeader header = HeaderOf({"run", sound}, cloud, RoomPose(1));
    header.content_hash = ContentHashOf(header, cloud);
    absl::StatusOr<std::unique_ptr<api::ScanUpload>> upload =
        db().scans().Upload({}, kMapName, header);
    STRATA_ASSERT_OK(upload);
    STRATA_ASSERT_OK((*upload)->Write(half));
    const FailingMemory failing(static_cast<std::int64_t>(sound), 10);
    upload->reset();
  }
  UploadRoom(100, RoomPose(1));
  ExpectSound();
}

}  // namespace
}  // namespace strata::testing
