#include "core/engine/map/writer.h"

#include <filesystem>
#include <memory>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include <gtest/gtest.h>

#include "core/common/stop.h"
#include "core/engine/map/disk_space.h"
#include "core/storage/sqlite/sqlite_storage.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

TEST(WriterTest, CountsItsCommitsAndWhatIsInThem) {
  const testing::TempDir dir;
  const std::filesystem::path file = dir.path() / "map.strata";
  STRATA_ASSERT_OK(CreateSqliteMap(file, {}, absl::Now()));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto storage, OpenSqliteStorage(file, {}));
  const DiskSpace disk(file);
  WriterThread writer(storage->writer(), disk, 1 << 20);
  EXPECT_EQ(writer.numbers().commits, 0);
  constexpr int kThreads = 8;
  constexpr int kEach = 20;
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&writer] {
      for (int i = 0; i < kEach; ++i) {
        STRATA_EXPECT_OK(writer.Run(Durability::kFull, 100, Stop(), [](StorageWriter& to) {
          return to.NextCommitSequence().status();
        }));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  writer.Close();
  const WriterNumbers numbers = writer.numbers();
  EXPECT_EQ(numbers.parts, kThreads * kEach);
  EXPECT_LE(numbers.commits, numbers.parts);
  EXPECT_GE(numbers.commits, kEach);  // a thread waits for each of its own
  EXPECT_GT(numbers.time, absl::ZeroDuration());
  EXPECT_EQ(numbers.queued_bytes, 0);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto reader, storage->NewReader());
  EXPECT_EQ(reader->GetClock()->commit_sequence, kThreads * kEach);
}

}  // namespace
}  // namespace strata
