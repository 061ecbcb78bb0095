// The jobs train and classify: interrupted, beside uploads, and with little to learn from.
#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/simulator/park.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

using Labels = std::vector<std::uint16_t>;

class EngineClassifyTest : public EngineTest {
 protected:
  // A labelled park and `scans` - 1 others, where they lie; a classifier "park" of the first.
  void MakeParks(std::uint64_t scans) {
    MakeMap();
    for (std::uint64_t i = 1; i <= scans; ++i) PutPark(i);
    WaitIntegrated(db());
    const JobInfo trained =
        RunJob(db(), "train", {{"name", "park"}, {"method", "bayes"}, {"reduce", "random=500"}});
    ASSERT_EQ(trained.state, JobState::kSucceeded) << trained.message;
  }
  void PutPark(std::uint64_t i) {
    PointCloud park = MakePark(i);
    if (i > 1) park.label.clear();
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", i}, park, RoomPose(i)), park));
  }
  Labels LabelsOf(std::uint64_t i) {
    Labels labels;
    STRATA_EXPECT_OK(db().scans().GetPoints({}, kMapName, {"run", i}, [&](const PointCloud& piece) {
      labels.insert(labels.end(), piece.label.begin(), piece.label.end());
      return absl::OkStatus();
    }));
    return labels;
  }
  std::vector<Labels> AllLabels(std::uint64_t scans) {
    std::vector<Labels> all;
    for (std::uint64_t i = 1; i <= scans; ++i) all.push_back(LabelsOf(i));
    return all;
  }
};

TEST_F(EngineClassifyTest, LabelsAreTheSameHoweverOftenTheJobIsCancelledOrTheEngineEnds) {
  constexpr std::uint64_t kScans = 8;
  MakeParks(kScans);
  Close();
  const std::filesystem::path copy = MapFile("undisturbed");
  std::filesystem::copy_file(MapFile(), copy);
  Reopen();
  const JobInfo job = RunJob(db(), "classify", {{"model", "park"}});
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_EQ(job.metrics.at("scans_labelled"), kScans);
  const std::vector<Labels> expected = AllLabels(kScans);
  const std::string digest = Digest();
  ExpectSound();

  // Again, on the copy.
  Close();
  std::filesystem::remove(MapFile());
  std::filesystem::rename(copy, MapFile());
  Reopen();
  for (int round = 0; round < 4; ++round) {
    STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo begun,
                                db().jobs().Start({}, kMapName, "classify", {{"model", "park"}}));
    absl::SleepFor(absl::Milliseconds(3 * round));
    if (round % 2 == 0) {
      STRATA_ASSERT_OK(db().jobs().Cancel({}, kMapName, begun.id));
    } else {
      Reopen();
    }
  }
  const JobInfo last = RunJob(db(), "classify", {{"model", "park"}});
  EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;
  EXPECT_EQ(AllLabels(kScans), expected);
  EXPECT_EQ(Digest(), digest);
  ExpectSound();
}

TEST_F(EngineClassifyTest, ScansThatComeInMeanwhileAreLabelledToo) {
  MakeParks(3);
  std::thread robot([this] {
    for (std::uint64_t i = 4; i <= 8; ++i) PutPark(i);
  });
  const JobInfo first = RunJob(db(), "classify", {{"model", "park"}});
  robot.join();
  EXPECT_EQ(first.state, JobState::kSucceeded) << first.message;
  const JobInfo second = RunJob(db(), "classify", {{"model", "park"}});
  EXPECT_EQ(second.metrics.at("scans_labelled") + second.metrics.at("scans_labelled_before"), 8.0);
  EXPECT_GE(second.metrics.at("scans_labelled_before"), 3.0);
  WaitIntegrated(db());
  for (std::uint64_t i = 1; i <= 8; ++i) EXPECT_EQ(LabelsOf(i).size(), MakePark(i).size());
  ExpectSound();
}

TEST_F(EngineClassifyTest, AnotherClassifierTakesThePlaceOfTheOneBefore) {
  MakeParks(2);
  RunJob(db(), "classify", {{"model", "park"}});
  const JobInfo trained = RunJob(db(), "train", {{"name", "second"}, {"method", "knn"}});
  EXPECT_EQ(trained.state, JobState::kSucceeded) << trained.message;
  // Learned from what people labelled, not from what the first one said.
  EXPECT_EQ(trained.metrics.at("scans"), 1.0);
  const JobInfo job = RunJob(db(), "classify", {{"model", "second"}});
  EXPECT_EQ(job.metrics.at("scans_labelled"), 2.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo scan, db().scans().Get({}, kMapName, {"run", 2}));
  EXPECT_EQ(scan.label_model, trained.metrics.at("model"));
  ExpectSound();
}

// As if the power had failed after the classifier was durable, and before its job was done.
TEST_F(EngineClassifyTest, AJobThatMadeItsClassifierBeforeACrashMakesNoSecondOne) {
  MakeParks(1);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<JobInfo> jobs, db().jobs().List({}, kMapName));
  const auto train = std::find_if(
      jobs.begin(), jobs.end(), [](const JobInfo& job) { return job.kind == "train"; });
  ASSERT_NE(train, jobs.end());
  Close();
  Sql("UPDATE truth_job SET state = 2 WHERE id = " + std::to_string(train->id));
  Reopen();
  JobInfo last;
  STRATA_ASSERT_OK(db().jobs().Watch({}, kMapName, train->id, [&last](const JobInfo& job) {
    last = job;
    return absl::OkStatus();
  }));
  EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;
  EXPECT_THAT(last.message, HasSubstr("classifier park"));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto all, db().classifiers().List({}, kMapName));
  EXPECT_EQ(all.size(), 1U);
}

// Leaving out either scan leaves one class, which cannot be told apart from nothing.
TEST_F(EngineClassifyTest, ScansOfOneClassEachAreLearnedFromWithoutAScore) {
  MakeMap();
  for (const std::uint16_t only : {kParkGround, kParkPole}) {
    PointCloud park = MakePark(only);
    for (std::uint16_t& label : park.label) label = label == only ? label : 0;
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", only}, park, RoomPose(only)), park));
  }
  WaitIntegrated(db());
  const JobInfo job = RunJob(db(), "train", {{"name", "park"}, {"method", "bayes"}});
  EXPECT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_THAT(job.message, HasSubstr("not validated"));
  EXPECT_FALSE(job.metrics.contains("accuracy"));
}

TEST_F(EngineClassifyTest, WithoutLabelsThereIsNothingToLearn) {
  MakeMap();
  UploadRooms(2);
  WaitIntegrated(db());
  const JobInfo job = RunJob(db(), "train", {{"name", "park"}});
  EXPECT_EQ(job.state, JobState::kFailed);
  EXPECT_THAT(job.message, HasSubstr("no scan has labels"));
}

TEST_F(EngineClassifyTest, ADamagedClassifierIsNamed) {
  MakeParks(1);
  Close();
  Sql("UPDATE truth_model_piece SET bytes = CAST(substr(bytes, 1, 60) || x'00ff' || substr(bytes, "
      "63) AS BLOB)");
  Reopen();
  EXPECT_THAT(RunJob(db(), "verify").message, HasSubstr("classifier park"));
  const JobInfo job = RunJob(db(), "classify", {{"model", "park"}});
  EXPECT_EQ(job.state, JobState::kFailed);
  EXPECT_THAT(job.message, HasSubstr("classifier park"));
}

}  // namespace
}  // namespace strata::testing
