// One conformance suite for every implementation of api::Database. A program that links it says
// which:
//
//   INSTANTIATE_TEST_SUITE_P(Engine, DatabaseSuite, ::testing::Values(DatabaseMaker{"InProcess",
//   …}),
//                            DatabaseMakerName);
#ifndef STRATA_TESTS_SUPPORT_DATABASE_SUITE_DATABASE_SUITE_H_
#define STRATA_TESTS_SUPPORT_DATABASE_SUITE_DATABASE_SUITE_H_

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/api/database.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {

// How to open a database over an empty directory.
struct DatabaseMaker {
  std::string name;  // letters and digits
  std::function<std::unique_ptr<api::Database>(const std::filesystem::path&)> make;
};

// What gtest prints of the parameter; the default, its bytes, differs from run to run.
void PrintTo(const DatabaseMaker& maker, std::ostream* out);
std::string DatabaseMakerName(const ::testing::TestParamInfo<DatabaseMaker>& info);

// A database with the empty map "world".
class DatabaseSuite : public ::testing::TestWithParam<DatabaseMaker> {
 protected:
  void SetUp() override;
  api::Database& db() { return *database_; }
  // Closes the database and opens it again.
  void Reopen();

 private:
  TempDir directory_;
  std::unique_ptr<api::Database> database_;
};

inline constexpr char kMap[] = "world";

// A level floor at z = 0, `side_m` long and wide around the origin, a point every 5 cm.
PointCloud LevelFloor(double side_m = 8.0);
// Header of `cloud` with the columns it has, taken as uploaded.
ScanHeader FloorHeader(const ScanId& id, const PointCloud& cloud, double x_m = 0.0);
// Uploads in pieces to the map; its acknowledgement.
absl::StatusOr<ScanAck> UploadScan(api::Database& database,
                                   const std::string& map,
                                   const ScanHeader& header,
                                   const PointCloud& cloud);
// Points [begin, end) with all their columns.
PointCloud Slice(const PointCloud& cloud, std::size_t begin, std::size_t end);
// A pose that no call takes.
const Pose& NanPose();
// Puts LevelFloor() into kMap at `x_m` and waits for its integration.
void PutFloor(api::Database& db, const ScanId& id, double x_m = 0.0);
// The ids in kMap that `filter` lets pass, as listed.
std::vector<ScanId> Listed(api::Database& db, const api::ScanFilter& filter);
// Returns once no scan of the map is pending.
void AwaitIntegration(api::Database& database, const std::string& map);
// Starts a job and waits for its end, which it returns.
JobInfo EndOfJob(api::Database& database,
                 const std::string& kind,
                 const JobParameters& parameters = {},
                 const std::string& map = kMap);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_DATABASE_SUITE_DATABASE_SUITE_H_
