// Records of LAZ files beside those that npm's laz-perf makes of them.
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "tests/client/formats/laz/laz_records.h"
#include "tests/support/data_dir.h"
#include "tests/support/paths.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

void ExpectSameAsLazPerf(const fs::path& file, const std::string& modules) {
  SCOPED_TRACE(file.filename().string());
  const testing::TempDir dir;
  const fs::path out = dir.path() / "records";
  const std::string command =
      absl::StrCat("node '",
                   testing::SourcePath("tests/client/formats/laz/laz_perf_records.cjs"),
                   "' '",
                   modules,
                   "' '",
                   file.string(),
                   "' '",
                   out.string(),
                   "'");
  ASSERT_EQ(std::system(command.c_str()), 0);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string theirs, ReadFileBytes(out));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, ReadFileBytes(file));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string ours, testing::RecordsOfLaz(bytes));
  EXPECT_FALSE(ours.empty());
  EXPECT_TRUE(ours == theirs);
}

// It knows versions 2 and 3, without wave packets.
bool LazPerfReads(const fs::path& file) {
  const std::string name = file.stem().string();
  return file.extension() == ".laz" && name != "format4" && !absl::StartsWith(name, "first_") &&
         !absl::StartsWith(name, "version4_");
}

TEST(LazPerfTest, RecordsAreTheSame) {
  const char* const modules = std::getenv("STRATA_NODE_MODULES");
  if (modules == nullptr || !fs::exists(fs::path(modules) / "laz-perf")) {
    GTEST_SKIP() << "no laz-perf: 'npm install --prefix DIR laz-perf' and set STRATA_NODE_MODULES "
                    "to DIR/node_modules";
  }
  std::vector<fs::path> files;
  const std::string packed = testing::SourcePath("tests/client/formats/laz/packed");
  for (const auto& entry : fs::directory_iterator(packed)) files.push_back(entry);
  STRATA_REQUIRE_DATA(samples, "importer_samples");
  for (const auto& entry : fs::directory_iterator(samples)) files.push_back(entry);
  for (const fs::path& file : files) {
    if (LazPerfReads(file)) ExpectSameAsLazPerf(file, modules);
  }
}

}  // namespace
}  // namespace strata
