// What only a map in a file does: a bound on its size, copies page by page.
#include "core/storage/sqlite/sqlite_storage.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/status.h"
#include "core/storage/storage.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

class SqliteStorageTest : public ::testing::Test {
 protected:
  void SetUp() override {
    STRATA_ASSERT_OK(CreateSqliteMap(file(), MapParameters(), absl::FromUnixSeconds(1000)));
    Reopen();
  }
  void Reopen(const SqliteOptions& options = {}) {
    reader_.reset();
    storage_.reset();
    auto opened = OpenSqliteStorage(file(), options);
    ASSERT_THAT(opened, IsOk());
    storage_ = *std::move(opened);
    auto reader = storage_->NewReader();
    ASSERT_THAT(reader, IsOk());
    reader_ = *std::move(reader);
  }
  std::filesystem::path file() const { return directory_.path() / "map.strata"; }
  StorageWriter& writer() { return storage_->writer(); }
  StorageReader& reader() { return *reader_; }
  absl::Status Commit(absl::FunctionRef<absl::Status()> body) {
    return writer().Commit(Durability::kFull, body);
  }
  void Put(std::uint64_t sequence) {
    ScanRecord scan;
    scan.header.id = {"run", sequence};
    scan.upload = sequence;
    scan.chunks = 1;
    STRATA_EXPECT_OK(Commit([&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(scan.number, writer().NextCommitSequence());
      STRATA_RETURN_IF_ERROR(writer().PutChunk(scan.upload, 0, "bytes"));
      return writer().PutScan(scan);
    }));
  }

  TempDir directory_;
  std::unique_ptr<MapStorage> storage_;
  std::unique_ptr<StorageReader> reader_;
};

// Or a nightly copy of a large map would be a whole one each night.
TEST_F(SqliteStorageTest, CopiesShareThePagesThatDidNotChange) {
  for (std::uint64_t i = 1; i <= 20; ++i) {
    STRATA_ASSERT_OK(Commit([&] { return writer().PutChunk(i, 0, std::string(50'000, 'a')); }));
  }
  const auto pages_of = [&](const char* name) {
    const std::filesystem::path file = directory_.path() / name;
    EXPECT_THAT(reader().CopyTo(file, Stop()), IsOk());
    std::ifstream stream(file, std::ios::binary);
    std::vector<std::string> pages;
    for (std::string page(8192, ' '); stream.read(page.data(), 8192);) pages.push_back(page);
    return pages;
  };
  const std::vector<std::string> before = pages_of("before.strata");
  STRATA_ASSERT_OK(Commit([&] { return writer().PutChunk(10, 1, std::string(50'000, 'b')); }));
  const std::vector<std::string> after = pages_of("after.strata");
  ASSERT_GT(before.size(), 20 * 50'000 / 8192);
  ASSERT_GE(after.size(), before.size());
  std::size_t changed = 0;
  for (std::size_t i = 0; i < before.size(); ++i) changed += before[i] == after[i] ? 0 : 1;
  EXPECT_LE(changed, 10U);
}

TEST_F(SqliteStorageTest, FullStoreIsAnErrorAndLosesNothing) {
  Put(1);
  Reopen({.max_file_bytes = 400'000});
  const std::string large(300'000, 'x');
  EXPECT_THAT(Commit([&]() -> absl::Status {
                STRATA_RETURN_IF_ERROR(writer().PutChunk(8, 0, large));
                return writer().PutChunk(8, 1, large);
              }),
              StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("full")));
  EXPECT_EQ(reader().GetScanTotals()->scans, 1U);
  Put(2);
}

// A full store ends the whole transaction, not the part alone that met it.
TEST_F(SqliteStorageTest, FullStoreInOnePartEndsTheWholeCommit) {
  Put(1);
  Reopen();  // all of it is in the file
  Reopen({.max_file_bytes = std::filesystem::file_size(file()) + 150'000});
  const std::string large(60'000, 'x');
  const auto part = [&](std::uint64_t upload, int pieces) {
    return writer().Part([&]() -> absl::Status {
      for (int i = 0; i < pieces; ++i) {
        STRATA_RETURN_IF_ERROR(writer().PutChunk(upload, static_cast<std::uint32_t>(i), large));
      }
      return absl::OkStatus();
    });
  };
  const auto full = StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("full"));
  EXPECT_THAT(Commit([&]() -> absl::Status {
                STRATA_EXPECT_OK(part(8, 1));
                EXPECT_THAT(part(9, 9), full);
                EXPECT_THAT(part(10, 1), full);
                return absl::OkStatus();
              }),
              full);
  for (const std::uint64_t upload : {8U, 9U, 10U}) {
    EXPECT_FALSE(reader().GetChunk(upload, 0).ok()) << upload;
  }
  Put(2);
}

}  // namespace
}  // namespace strata::testing
