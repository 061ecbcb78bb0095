// Classifiers learn from and label a map that robots upload to, and the server is killed under
// them.
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/status.h"
#include "tests/integration/crashes/killed_server.h"
#include "tests/support/asked.h"
#include "tests/support/simulator/park.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

constexpr char kMap[] = "park";
constexpr std::uint64_t kBefore = 12;   // scans that are there when the job begins
constexpr std::uint64_t kPerRound = 2;  // scans uploaded before each kill

struct Outcome {
  std::vector<std::vector<std::uint16_t>> labels;  // of every scan
  std::string digest;
};

class World : public KilledServer {
 public:
  World() : KilledServer(kMap) {}

  // Every second of the first scans is labelled.
  absl::Status Put(std::uint64_t i) {
    PointCloud park = MakePark(i);
    if (i > kBefore || i % 2 == 0) park.label.clear();
    ScanHeader header;
    header.id = {"run", i};
    header.T_map_scan =
        MakePose(Eigen::Quaterniond::Identity(), {3.0 * static_cast<double>(i), 0.0, 0.0});
    header.alignment = Alignment::kOff;
    header.point_count = park.size();
    header.has_label = !park.label.empty();
    STRATA_ASSIGN_OR_RETURN(const auto upload, db().scans().Upload({}, kMap, header));
    STRATA_RETURN_IF_ERROR(upload->Write(park));
    return upload->Finish().status();
  }
  // A map of the first scans and a classifier of them.
  void Prepare() {
    STRATA_ASSERT_OK(db().maps().Create({}, kMap, {}));
    for (std::uint64_t i = 1; i <= kBefore; ++i) STRATA_ASSERT_OK(Put(i));
    Run("train", {{"name", "street"}, {"method", "amn"}, {"reduce", "depth=6"}, {"folds", "0"}});
  }
  // Of the bytes of every classifier there is.
  std::vector<std::string> Classifiers() {
    std::vector<std::string> all;
    const auto infos = db().classifiers().List({}, kMap);
    STRATA_EXPECT_OK(infos);
    for (const ClassifierInfo& info : infos.value_or(std::vector<ClassifierInfo>())) {
      std::string& bytes = all.emplace_back();
      STRATA_EXPECT_OK(
          db().classifiers().Export({}, kMap, info.name, [&bytes](absl::string_view piece) {
            bytes.append(piece.data(), piece.size());
            return absl::OkStatus();
          }));
    }
    return all;
  }
  Outcome Result(std::uint64_t scans) {
    Outcome outcome;
    for (std::uint64_t i = 1; i <= scans; ++i) {
      auto& labels = outcome.labels.emplace_back();
      STRATA_EXPECT_OK(db().scans().GetPoints({}, kMap, {"run", i}, [&](const PointCloud& piece) {
        labels.insert(labels.end(), piece.label.begin(), piece.label.end());
        return absl::OkStatus();
      }));
    }
    AwaitIntegrated();
    const auto stats = db().maps().Stats({}, kMap);
    STRATA_EXPECT_OK(stats);
    if (stats.ok()) outcome.digest = stats->content_digest;
    Run("verify");
    return outcome;
  }
};

class ClassifyCrashTest : public ::testing::Test {
 protected:
  void KillWithin(World& world, std::uint64_t most_ms) {
    absl::SleepFor(absl::Milliseconds(random_() % most_ms));
    world.Kill();
  }
  const std::uint64_t kills_ = Asked("STRATA_KILLS", 3);
  const std::uint64_t seed_ = Asked("STRATA_SEED", 20261122);
  const ::testing::ScopedTrace trace_{__FILE__, __LINE__, absl::StrCat("seed ", seed_)};
  std::mt19937_64 random_{seed_};
};

TEST_F(ClassifyCrashTest, LabelsAreThoseOfAnUndisturbedJob) {
  const std::uint64_t scans = kBefore + kPerRound * kills_;
  Outcome expected;
  {
    World world;
    ASSERT_NO_FATAL_FAILURE(world.Prepare());
    for (std::uint64_t i = kBefore + 1; i <= scans; ++i) STRATA_ASSERT_OK(world.Put(i));
    EXPECT_EQ(world.Run("classify", {{"model", "street"}}).metrics.at("scans_labelled"), scans);
    expected = world.Result(scans);
  }
  for (const auto& labels : expected.labels)
    EXPECT_THAT(labels, ::testing::Not(::testing::IsEmpty()));

  World world;
  ASSERT_NO_FATAL_FAILURE(world.Prepare());
  const JobParameters parameters = {{"model", "street"}};
  STRATA_ASSERT_OK_AND_ASSIGN(JobInfo job,
                              world.db().jobs().Start({}, kMap, "classify", parameters));
  std::uint64_t next = kBefore + 1;
  for (std::uint64_t round = 0; round < kills_; ++round) {
    for (std::uint64_t k = 0; k < kPerRound; ++k) STRATA_ASSERT_OK(world.Put(next++));
    KillWithin(world, 150);
  }
  world.Follow(job.id);
  // What came in after the job had ended, if it was quick.
  world.Run("classify", {{"model", "street"}});
  const Outcome outcome = world.Result(scans);
  EXPECT_EQ(outcome.labels, expected.labels);
  EXPECT_EQ(outcome.digest, expected.digest);
}

TEST_F(ClassifyCrashTest, AClassifierIsLearnedOnceAndIsThatOfAnUndisturbedJob) {
  const std::map<std::string, std::string> parameters = {{"name", "again"}, {"folds", "4"}};
  World world;
  ASSERT_NO_FATAL_FAILURE(world.Prepare());
  world.Run("train", {{"name", "calm"}, {"folds", "4"}});
  ASSERT_EQ(world.Classifiers().size(), 2U);
  const std::string calm = world.Classifiers()[1];
  STRATA_ASSERT_OK_AND_ASSIGN(JobInfo job, world.db().jobs().Start({}, kMap, "train", parameters));
  for (std::uint64_t round = 0; round < kills_; ++round) {
    KillWithin(world, 400);
  }
  world.Follow(job.id);
  const std::vector<std::string> all = world.Classifiers();
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[2], calm);
}

}  // namespace
}  // namespace strata::testing
