#include "client/sdk/spool.h"

#include <algorithm>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "core/engine/engine.h"
#include "core/geometry/pose.h"
#include "tests/support/mock_database.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Return;
using Code = absl::StatusCode;

constexpr char kMap[] = "campus";

PointCloud CloudOf(std::uint64_t seed, std::size_t points = 3'000) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> place(-10.0F, 10.0F);
  PointCloud cloud;
  for (std::size_t i = 0; i < points; ++i) {
    cloud.points.emplace_back(place(random), place(random), 0.1F * place(random));
    cloud.intensity.push_back(place(random));
  }
  return cloud;
}

ScanHeader HeaderOf(std::uint64_t sequence, const PointCloud& cloud) {
  ScanHeader header;
  header.id = {"run", sequence};
  header.T_map_scan =
      MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * static_cast<double>(sequence),
                                                    Eigen::Vector3d(0.6, 0.0, 0.8))),
               {1.0 / 3.0, static_cast<double>(sequence), 0.0});
  header.alignment = Alignment::kOff;
  header.point_count = cloud.size();
  header.has_intensity = true;
  return header;
}

std::string BytesOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// A spool, and a real database that its scans go to.
class SpoolTest : public ::testing::Test {
 protected:
  void SetUp() override {
    EngineOptions options;
    options.directory = directory_.path() / "maps";
    auto engine = OpenEngine(options);
    ASSERT_THAT(engine, IsOk());
    db_ = *std::move(engine);
    STRATA_ASSERT_OK(db_->maps().Create({}, kMap, {}));
    Open();
  }

  fs::path Folder(const std::string& name) const { return directory_.path() / "spool" / name; }
  void Open(const SpoolOptions& options = {}) {
    spool_ = nullptr;
    auto spool = Spool::Open(directory_.path() / "spool", options);
    ASSERT_THAT(spool, IsOk());
    spool_ = *std::move(spool);
  }
  void Add(std::uint64_t sequence, const std::string& map = kMap) {
    const PointCloud cloud = CloudOf(sequence);
    STRATA_ASSERT_OK(spool_->Add(map, HeaderOf(sequence, cloud), cloud));
  }
  std::vector<std::uint64_t> Stored() {
    std::vector<std::uint64_t> sequences;
    STRATA_EXPECT_OK(db_->scans().List({}, kMap, {}, [&](const ScanInfo& info) {
      sequences.push_back(info.header.id.sequence);
      return absl::OkStatus();
    }));
    return sequences;
  }
  static std::vector<fs::path> FilesIn(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
  }

  ::strata::testing::TempDir directory_;
  std::unique_ptr<api::Database> db_;
  std::unique_ptr<Spool> spool_;
};

TEST_F(SpoolTest, ScansAreSentInOrderAndTheirFilesGo) {
  for (const std::uint64_t sequence : {3, 1, 2}) Add(sequence);
  Open();  // as after a crash
  EXPECT_EQ(spool_->status().waiting, 3U);
  EXPECT_THAT(spool_->Waiting(kMap),
              ElementsAre(ScanId{"run", 3}, ScanId{"run", 1}, ScanId{"run", 2}));
  STRATA_ASSERT_OK(spool_->Send({}, *db_));
  EXPECT_THAT(Stored(), ElementsAre(3, 1, 2));
  EXPECT_EQ(spool_->status().waiting, 0U);
  EXPECT_EQ(spool_->status().sent, 3U);
  EXPECT_THAT(FilesIn(Folder("waiting")), IsEmpty());
  const PointCloud cloud = CloudOf(2);
  PointCloud back;
  STRATA_ASSERT_OK(db_->scans().GetPoints({}, kMap, {"run", 2}, [&](const PointCloud& piece) {
    back = piece;
    return absl::OkStatus();
  }));
  EXPECT_EQ(back.points, cloud.points);
  EXPECT_EQ(back.intensity, cloud.intensity);
  Add(2);  // again: is there, and goes
  STRATA_ASSERT_OK(spool_->Send({}, *db_));
  EXPECT_THAT(Stored(), ElementsAre(3, 1, 2));
}

TEST_F(SpoolTest, OthersOfTheMachineCannotReadIt) {
  spool_ = nullptr;
  fs::remove_all(directory_.path() / "spool");
  const mode_t before = ::umask(0);
  Open();
  Add(1);
  ::umask(before);
  const auto others = [](const fs::path& path) {
    return fs::status(path).permissions() & fs::perms::others_all;
  };
  EXPECT_EQ(others(Folder("waiting")), fs::perms::none);
  for (const fs::path& file : FilesIn(Folder("waiting"))) {
    EXPECT_EQ(others(file), fs::perms::none) << file;
  }
}

TEST_F(SpoolTest, OnlyWhatTheServerLacksIsSent) {
  const PointCloud cloud = CloudOf(1, 90'000);
  STRATA_ASSERT_OK(spool_->Add(kMap, HeaderOf(1, cloud), cloud));
  ::testing::NiceMock<::strata::testing::MockDatabase> server;
  std::string hash;
  std::size_t written = 0;
  EXPECT_CALL(server.scans(), Upload(_, _, _))
      .WillRepeatedly([&](auto&, auto, const ScanHeader& header)
                          -> absl::StatusOr<std::unique_ptr<api::ScanUpload>> {
        hash = header.content_hash;
        auto upload = std::make_unique<::testing::NiceMock<::strata::testing::MockScanUpload>>();
        ON_CALL(*upload, points_held()).WillByDefault(Return(45'000));
        ON_CALL(*upload, Write(_)).WillByDefault([&](const PointCloud& chunk) {
          EXPECT_EQ(chunk.points.front(), cloud.points[45'000 + written]);
          written += chunk.size();
          return absl::OkStatus();
        });
        ON_CALL(*upload, Finish())
            .WillByDefault(Return(ScanAck{header.id, 1, false, std::string(32, 'f')}));
        return upload;
      });
  // Acknowledged is not enough: it must be this content.
  EXPECT_THAT(spool_->Send({}, server), StatusIs(Code::kInternal, HasSubstr(std::string(32, 'f'))));
  EXPECT_EQ(written, 45'000U);
  EXPECT_EQ(hash.size(), 32U);
  EXPECT_EQ(spool_->status().waiting, 1U);
  EXPECT_THAT(spool_->status().last_error, HasSubstr("run/1"));
}

TEST_F(SpoolTest, WhatIsRefusedForGoodIsSetAsideWithItsReason) {
  Add(1);
  STRATA_ASSERT_OK(spool_->Send({}, *db_));
  const PointCloud other = CloudOf(77);
  STRATA_ASSERT_OK(spool_->Add(kMap, HeaderOf(1, other), other));
  Add(2);
  STRATA_ASSERT_OK(spool_->Send({}, *db_));
  EXPECT_THAT(Stored(), ElementsAre(1, 2));
  EXPECT_EQ(spool_->status().refused, 1U);
  const std::vector<fs::path> files = FilesIn(Folder("refused"));
  ASSERT_EQ(files.size(), 2U);
  EXPECT_EQ(files[0].extension(), ".scan");
  EXPECT_THAT(BytesOf(files[1]), AllOf(HasSubstr("run/1"), HasSubstr("other content")));
  Open();
  EXPECT_EQ(spool_->status().refused, 1U);
}

TEST_F(SpoolTest, AServerThatIsAwayLosesNothing) {
  Add(1);
  Add(2);
  ::testing::NiceMock<::strata::testing::MockDatabase> server;
  EXPECT_CALL(server.scans(), Upload(_, _, _)).WillOnce([](auto&, auto, auto&) {
    return absl::StatusOr<std::unique_ptr<api::ScanUpload>>(absl::UnavailableError("gone"));
  });
  EXPECT_THAT(spool_->Send({}, server), StatusIs(Code::kUnavailable, "gone"));
  EXPECT_EQ(spool_->status().waiting, 2U);
  EXPECT_EQ(spool_->status().last_error, "gone");
  STRATA_ASSERT_OK(spool_->Send({}, *db_));
  EXPECT_THAT(Stored(), ElementsAre(1, 2));
  EXPECT_THAT(spool_->status().last_error, IsEmpty());
}

TEST_F(SpoolTest, AMapThatIsNotThereHoldsBackOnlyItsOwn) {
  Add(1, "elsewhere");
  Add(2, "elsewhere");
  Add(3);
  EXPECT_THAT(spool_->Send({}, *db_), StatusIs(Code::kNotFound, HasSubstr("elsewhere")));
  EXPECT_THAT(Stored(), ElementsAre(3));
  EXPECT_EQ(spool_->status().waiting, 2U);
  STRATA_ASSERT_OK(db_->maps().Create({}, "elsewhere", {}));
  STRATA_ASSERT_OK(spool_->Send({}, *db_));
  EXPECT_EQ(spool_->status().waiting, 0U);
}

TEST_F(SpoolTest, AFullSpoolSaysSoAndAddsNothing) {
  Add(1);
  SpoolOptions options;
  options.max_bytes = spool_->status().waiting_bytes * 3 / 2;
  Open(options);
  const PointCloud cloud = CloudOf(2);
  EXPECT_THAT(spool_->Add(kMap, HeaderOf(2, cloud), cloud),
              StatusIs(Code::kResourceExhausted, AllOf(HasSubstr("run/2"), HasSubstr("full"))));
  EXPECT_EQ(spool_->status().waiting, 1U);
  STRATA_ASSERT_OK(spool_->Send({}, *db_));
  Add(2);
}

TEST_F(SpoolTest, AFullDiskIsAnErrorAndLeavesNothing) {
  Add(1);
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit small = before;
  small.rlim_cur = 10'000;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const PointCloud cloud = CloudOf(2);
  const absl::Status added = spool_->Add(kMap, HeaderOf(2, cloud), cloud);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_THAT(added, StatusIs(Code::kResourceExhausted, HasSubstr("run/2")));
  EXPECT_THAT(FilesIn(Folder("adding")), IsEmpty());
  EXPECT_EQ(FilesIn(Folder("waiting")).size(), 1U);
  Add(3);
  STRATA_ASSERT_OK(spool_->Send({}, *db_));
  EXPECT_THAT(Stored(), ElementsAre(1, 3));
}

TEST_F(SpoolTest, HasOneOwner) {
  Add(1);
  EXPECT_THAT(Spool::Open(directory_.path() / "spool").status(),
              StatusIs(Code::kFailedPrecondition, HasSubstr("another process")));
  STRATA_ASSERT_OK_AND_ASSIGN(const SpoolStatus seen, Spool::Look(directory_.path() / "spool"));
  EXPECT_EQ(seen.waiting, 1U);
  EXPECT_EQ(seen.waiting_bytes, spool_->status().waiting_bytes);
  EXPECT_THAT(Spool::Look(directory_.path() / "nothing").status(),
              StatusIs(Code::kNotFound, HasSubstr("nothing")));
}

TEST_F(SpoolTest, WhatNoServerWouldTakeIsRefusedAtOnce) {
  PointCloud cloud = CloudOf(1);
  ScanHeader header = HeaderOf(1, cloud);
  const auto invalid = [](const char* what) {
    return StatusIs(Code::kInvalidArgument, HasSubstr(what));
  };
  EXPECT_THAT(spool_->Add("a b", header, cloud), invalid("map name"));
  header.point_count = 17;
  EXPECT_THAT(spool_->Add(kMap, header, cloud), invalid("announced 17"));
  header = HeaderOf(1, cloud);
  header.has_colour = true;
  EXPECT_THAT(spool_->Add(kMap, header, cloud), invalid("colour"));
  header = HeaderOf(1, cloud);
  cloud.points[2'000].z() = std::numeric_limits<float>::infinity();
  EXPECT_THAT(spool_->Add(kMap, header, cloud), invalid("point 2000"));
  EXPECT_EQ(spool_->status().waiting, 0U);
}

// Bytes that are changed, cut off or added anywhere: such a file is set aside, the others go.
TEST_F(SpoolTest, DamagedFilesAreSetAside) {
  Add(1);
  const fs::path file = FilesIn(Folder("waiting")).front();
  const std::string good = BytesOf(file);
  spool_ = nullptr;
  constexpr std::uint64_t kSeed = 20261122;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937_64 random(kSeed);
  for (int round = 0; round < 200; ++round) {
    std::string bad = good;
    // The head is a small part of the file, and gets half of the faults.
    const std::size_t within = round % 2 == 0 ? 250 : good.size();
    const std::size_t place = random() % within;
    switch (round % 3) {
      case 0:
        bad[place] = static_cast<char>(bad[place] ^ (1 << random() % 8));
        break;
      case 1:
        bad.resize(place);
        break;
      default:
        bad += std::string(1 + random() % 9, static_cast<char>(random()));
    }
    if (round % 2 == 0 && round % 3 == 0 && place >= 8 && place < 12) continue;  // the version
    std::ofstream(file, std::ios::binary | std::ios::trunc) << bad;
    Open();
    STRATA_ASSERT_OK(spool_->Send({}, *db_)) << "round " << round << " at " << place;
    ASSERT_EQ(spool_->status().damaged, 1U) << "round " << round << " at " << place;
    EXPECT_EQ(BytesOf(Folder("damaged") / file.filename()), bad);
    spool_ = nullptr;
    fs::remove_all(Folder("damaged"));
  }
  EXPECT_THAT(Stored(), IsEmpty());
  Open();
  Add(2);
  STRATA_ASSERT_OK(spool_->Send({}, *db_));
  EXPECT_THAT(Stored(), ElementsAre(2));
}

TEST_F(SpoolTest, AFileOfALaterVersionIsLeftAlone) {
  Add(1);
  const fs::path file = FilesIn(Folder("waiting")).front();
  std::string bytes = BytesOf(file);
  bytes[8] = 2;
  spool_ = nullptr;
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
  EXPECT_THAT(Spool::Open(directory_.path() / "spool").status(),
              StatusIs(Code::kUnimplemented, HasSubstr("update it")));
  EXPECT_EQ(BytesOf(file), bytes);
}

TEST_F(SpoolTest, TheSenderSendsWhatComesAndEndsSoon) {
  {
    const SpoolSender sender(*spool_, *db_);
    for (const std::uint64_t sequence : {1, 2, 3, 4}) Add(sequence);
    while (spool_->status().waiting > 0) absl::SleepFor(absl::Milliseconds(5));
    EXPECT_THAT(Stored(), ElementsAre(1, 2, 3, 4));
  }
  Add(5);
  ::testing::NiceMock<::strata::testing::MockDatabase> server;
  ON_CALL(server.scans(), Upload(_, _, _)).WillByDefault([](auto&, auto, auto&) {
    return absl::StatusOr<std::unique_ptr<api::ScanUpload>>(absl::UnavailableError("gone"));
  });
  {
    const SpoolSender sender(*spool_, server);
    while (spool_->status().last_error.empty()) absl::SleepFor(absl::Milliseconds(5));
  }
  EXPECT_EQ(spool_->status().waiting, 1U);
}

}  // namespace
}  // namespace strata
