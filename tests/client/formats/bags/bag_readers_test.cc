// The containers: MCAP, rosbag2's SQLite and ROS 1's bag give the same messages, whole or damaged.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/bags/bag_reader.h"
#include "client/formats/file_bytes.h"
#include "tests/support/bag_writer.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::BagEntry;
using ::strata::testing::McapForm;
using ::strata::testing::StatusIs;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// What a reader gave.
struct Visited {
  std::vector<BagEntry> entries;
  std::vector<std::string> damage;
};

class BagReadersTest : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& name, const std::string& bytes) const {
    STRATA_EXPECT_OK(WriteFileBytes(dir_.path() / name, bytes));
    return dir_.path() / name;
  }
  // Messages as they were visited; each is read again by its place and must be the same.
  static absl::StatusOr<Visited> ReadAll(const std::filesystem::path& path) {
    auto reader = OpenBagFile(path);
    if (!reader.ok()) return reader.status();
    Visited visited;
    std::vector<MessagePlace> places;
    const absl::Status status = (*reader)->Visit([&](const BagMessage& message) {
      const BagTopic& topic = (*reader)->topics()[message.topic];
      visited.entries.push_back(
          {topic.name, topic.type, message.time_ns, std::string(message.bytes)});
      places.push_back(message.place);
      return absl::OkStatus();
    });
    if (!status.ok()) return status;
    visited.damage = (*reader)->damage();
    // Backwards, so that chunks are loaded again.
    for (std::size_t i = places.size(); i-- > 0;) {
      const auto again = (*reader)->Read(places[i]);
      EXPECT_TRUE(again.ok()) << again.status();
      EXPECT_TRUE(again.ok() && *again == visited.entries[i].bytes) << i;
    }
    return visited;
  }
  testing::TempDir dir_;
};

std::vector<BagEntry> DrawEntries(std::uint64_t seed, const std::string& type) {
  std::mt19937_64 random(seed);
  std::vector<BagEntry> entries;
  for (int i = 0; i < 200; ++i) {
    BagEntry entry;
    entry.topic = absl::StrCat("/topic", random() % 3);
    entry.type = type;
    entry.time_ns = 1'700'000'000'000'000'000 + 7'000'000 * i;
    entry.bytes.resize(random() % 3000);
    for (char& c : entry.bytes) c = static_cast<char>(random() % 7);
    entries.push_back(std::move(entry));
  }
  return entries;
}

void ExpectSame(const std::vector<BagEntry>& read, const std::vector<BagEntry>& written) {
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].topic, written[i].topic);
    EXPECT_EQ(read[i].type, "std_msgs/String");
    EXPECT_EQ(read[i].time_ns, written[i].time_ns);
    ASSERT_TRUE(read[i].bytes == written[i].bytes) << i;
  }
}

TEST_F(BagReadersTest, McapWithAndWithoutChunksIndexAndChecksums) {
  const std::vector<BagEntry> entries = DrawEntries(1, "std_msgs/msg/String");
  for (const char* compression : {"", "lz4", "zstd"}) {
    for (const bool full : {true, false}) {
      for (const std::size_t chunk : {std::size_t{1}, std::size_t{20'000}, std::size_t{1} << 30}) {
        SCOPED_TRACE(absl::StrCat(compression, " ", full, " ", chunk));
        const McapForm form = {.compression = compression,
                               .checksums = full,
                               .index = full,
                               .attachment = full,
                               .chunk_bytes = chunk};
        const auto path = Write("a.mcap", testing::McapBytes(entries, form));
        STRATA_ASSERT_OK_AND_ASSIGN(const Visited visited, ReadAll(path));
        ExpectSame(visited.entries, entries);
        EXPECT_THAT(visited.damage, IsEmpty());
      }
    }
  }
  STRATA_ASSERT_OK_AND_ASSIGN(
      const Visited visited,
      ReadAll(Write("b.mcap", testing::McapBytes(entries, {.chunks = false}))));
  ExpectSame(visited.entries, entries);
}

TEST_F(BagReadersTest, Ros1PlainAndPacked) {
  const std::vector<BagEntry> entries = DrawEntries(2, "std_msgs/String");
  for (const char* compression : {"none", "bz2", "lz4"}) {
    SCOPED_TRACE(compression);
    const auto path = Write("a.bag", testing::Ros1BagBytes(entries, compression, 20'000));
    STRATA_ASSERT_OK_AND_ASSIGN(const Visited visited, ReadAll(path));
    ExpectSame(visited.entries, entries);
    EXPECT_THAT(visited.damage, IsEmpty());
  }
}

TEST_F(BagReadersTest, SqliteInTheOrderOfItsRows) {
  const std::vector<BagEntry> entries = DrawEntries(3, "std_msgs/msg/String");
  ASSERT_TRUE(testing::WriteDb3(dir_.path() / "a.db3", entries));
  STRATA_ASSERT_OK_AND_ASSIGN(const Visited visited, ReadAll(dir_.path() / "a.db3"));
  ExpectSame(visited.entries, entries);
  EXPECT_THAT(visited.damage, IsEmpty());
}

// Of a file cut at any byte, the messages before are there and the end is said.
TEST_F(BagReadersTest, CutFilesGiveWhatComesBefore) {
  const std::vector<BagEntry> mcap = DrawEntries(4, "std_msgs/msg/String");
  const std::vector<BagEntry> ros1 = DrawEntries(4, "std_msgs/String");
  const std::string files[] = {
      testing::McapBytes(mcap, {.chunk_bytes = 30'000}),
      testing::McapBytes(mcap, {.compression = "zstd", .chunk_bytes = 30'000}),
      testing::McapBytes(mcap, {.compression = "lz4", .chunk_bytes = 30'000}),
      testing::McapBytes(mcap, {.chunks = false}),
      testing::Ros1BagBytes(ros1, "none", 30'000),
      testing::Ros1BagBytes(ros1, "bz2", 30'000),
      testing::Ros1BagBytes(ros1, "lz4", 30'000),
  };
  std::mt19937_64 random(5);
  for (const std::string& file : files) {
    std::size_t most = 0;
    for (int i = 0; i < 40; ++i) {
      const std::size_t size = 20 + random() % (file.size() * 9 / 10);
      STRATA_ASSERT_OK_AND_ASSIGN(const Visited visited,
                                  ReadAll(Write("cut", file.substr(0, size))));
      most = std::max(most, visited.entries.size());
      for (std::size_t k = 0; k < visited.entries.size(); ++k) {
        ASSERT_TRUE(visited.entries[k].bytes == mcap[k].bytes) << k;
      }
    }
    EXPECT_GT(most, 100U);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const Visited cut,
                              ReadAll(Write("cut", files[0].substr(0, 100'000))));
  EXPECT_GT(cut.entries.size(), 50U);  // also those of the chunk that it ends in
  EXPECT_THAT(cut.damage, Contains(HasSubstr("ends at byte 100000")));
  EXPECT_THAT(cut.damage, Contains(HasSubstr("cut short; its first messages are read")));
}

TEST_F(BagReadersTest, OfADamagedSqliteFileAllOtherMessagesAreRead) {
  const std::vector<BagEntry> entries = DrawEntries(11, "std_msgs/msg/String");
  ASSERT_TRUE(testing::WriteDb3(dir_.path() / "a.db3", entries));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string file, ReadFileBytes(dir_.path() / "a.db3"));
  std::string holed = file;
  constexpr std::size_t kPage = 4096;
  std::fill_n(
      holed.begin() + static_cast<std::ptrdiff_t>(file.size() / 2 / kPage * kPage), kPage, '\x5a');
  STRATA_ASSERT_OK_AND_ASSIGN(const Visited around, ReadAll(Write("holed.db3", holed)));
  EXPECT_GT(around.entries.size(), 180U);
  EXPECT_LT(around.entries.size(), 200U);
  EXPECT_EQ(around.entries.back().bytes, entries.back().bytes);
  EXPECT_THAT(around.damage, Contains(HasSubstr("after message ")));
  // What lies beyond the end reads as zeros there, so that nobody knows which messages are whole.
  EXPECT_THAT(ReadAll(Write("cut.db3", file.substr(0, file.size() / 2))),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("sqlite3 FILE .recover")));
}

// An import reads twice; damage may hide the first messages.
TEST_F(BagReadersTest, ADamagedSqliteFileGivesTheSameTwice) {
  const std::vector<BagEntry> entries = DrawEntries(12, "std_msgs/msg/String");
  ASSERT_TRUE(testing::WriteDb3(dir_.path() / "a.db3", entries));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string file, ReadFileBytes(dir_.path() / "a.db3"));
  constexpr std::ptrdiff_t kPage = 4096;
  int without_the_first = 0;
  for (std::ptrdiff_t page = 3; page < 12; ++page) {
    std::string holed = file;
    std::fill_n(holed.begin() + page * kPage, kPage, '\x5a');
    const auto reader = OpenBagFile(Write("holed.db3", holed));
    if (!reader.ok()) continue;
    std::vector<std::vector<std::int64_t>> times(2);
    for (std::vector<std::int64_t>& visit : times) {
      STRATA_ASSERT_OK((*reader)->Visit([&visit](const BagMessage& message) {
        visit.push_back(message.time_ns);
        return absl::OkStatus();
      }));
    }
    EXPECT_EQ(times[0], times[1]) << page;
    without_the_first += !times[0].empty() && times[0][0] != entries[0].time_ns ? 1 : 0;
  }
  EXPECT_GT(without_the_first, 0);
}

TEST_F(BagReadersTest, AChunkWithAnotherChecksumIsLeftOutAndTheOthersAreRead) {
  const std::vector<BagEntry> entries = DrawEntries(6, "std_msgs/msg/String");
  std::string file = testing::McapBytes(entries, {.chunk_bytes = 30'000});
  file[50'000] = static_cast<char>(file[50'000] ^ 1);
  STRATA_ASSERT_OK_AND_ASSIGN(const Visited visited, ReadAll(Write("a.mcap", file)));
  EXPECT_LT(visited.entries.size(), 195U);
  EXPECT_GT(visited.entries.size(), 150U);
  EXPECT_THAT(visited.damage, ElementsAre(HasSubstr("another checksum")));
}

TEST_F(BagReadersTest, SizesAreNotBelieved) {
  const std::vector<BagEntry> entries = DrawEntries(7, "std_msgs/msg/String");
  const std::string file = testing::McapBytes(entries, {.compression = "zstd"});
  // Behind magic, header record, and the head and times of the chunk: what it says to unpack to.
  const std::size_t header = 8 + 9 + 4 + 4 + 4 + 10;
  const std::size_t size_at = header + 9 + 16;
  for (const std::uint64_t size :
       {std::uint64_t{1} << 62, std::uint64_t{1} << 29, std::uint64_t{9}}) {
    std::string damaged = file;
    std::memcpy(damaged.data() + size_at, &size, sizeof(size));
    STRATA_ASSERT_OK_AND_ASSIGN(const Visited visited, ReadAll(Write("a.mcap", damaged)));
    EXPECT_THAT(visited.entries, IsEmpty());
    EXPECT_THAT(visited.damage, Contains(HasSubstr("left out"))) << size;
  }
}

// Whatever single bytes become, there is no crash, and memory and time stay those of the file.
TEST_F(BagReadersTest, ChangedBytesAreDamageOrOtherMessages) {
  const std::vector<BagEntry> entries = DrawEntries(8, "std_msgs/msg/String");
  std::vector<std::string> files = {testing::McapBytes(entries, {.compression = "lz4"}),
                                    testing::McapBytes(entries, {.checksums = false}),
                                    testing::Ros1BagBytes(entries, "bz2", 30'000),
                                    testing::Ros1BagBytes(entries, "none", 30'000)};
  ASSERT_TRUE(testing::WriteDb3(dir_.path() / "a.db3", entries));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string db3, ReadFileBytes(dir_.path() / "a.db3"));
  files.push_back(db3);
  std::mt19937_64 random(9);
  for (const std::string& file : files) {
    for (int i = 0; i < 100; ++i) {
      std::string damaged = file;
      for (std::uint64_t k = 1 + random() % 5; k > 0; --k) {
        damaged[16 + random() % (damaged.size() - 16)] = static_cast<char>(random());
      }
      const auto reader = OpenBagFile(Write("damaged", damaged));
      if (!reader.ok()) continue;  // SQLite may see it at once
      (*reader)->Visit([](const BagMessage&) { return absl::OkStatus(); }).IgnoreError();
    }
  }
}

TEST_F(BagReadersTest, WhatIsNoBagSaysSo) {
  EXPECT_THAT(OpenBagFile(dir_.path() / "none.mcap"),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("none.mcap")));
  EXPECT_THAT(OpenBagFile(Write("x.mcap", "version https://git-lfs.github.com/spec/v1")),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("no bag by its first bytes")));
  EXPECT_THAT(OpenBagFile(Write("x.bag", "#ROSBAG V1.2\n")),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("rosbag fix")));
}

TEST_F(BagReadersTest, AVisitorEndsTheVisit) {
  const auto path = Write("a.mcap", testing::McapBytes(DrawEntries(10, "a/msg/B")));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto reader, OpenBagFile(path));
  int visits = 0;
  EXPECT_THAT(reader->Visit([&visits](const BagMessage&) {
    return ++visits == 3 ? absl::CancelledError("enough") : absl::OkStatus();
  }),
              StatusIs(absl::StatusCode::kCancelled, "enough"));
  EXPECT_EQ(visits, 3);
}

}  // namespace
}  // namespace strata
