#include "client/formats/bags/mcap_writer.h"

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "client/formats/bags/unpack.h"
#include "client/formats/parsing/byte_cursor.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using testing::IsOk;

const McapSchema kNumbers = {"test.Number", "jsonschema", R"({"type":"number"})"};
const McapSchema kTexts = {"test.Text", "jsonschema", R"({"type":"string"})"};
constexpr std::size_t kMagicBytes = 8;
// The footer's record, without its checksum.
constexpr std::size_t kFooterBytes = 1 + 8 + 8 + 8;

std::uint32_t Crc(absl::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

struct Record {
  int op = 0;
  absl::string_view content;
  std::size_t end = 0;
};

Record RecordAt(absl::string_view bytes, std::size_t at) {
  ByteCursor cursor(bytes.substr(at));
  Record record;
  record.op = cursor.Get<std::uint8_t>();
  record.content = cursor.TakeSized<std::uint64_t>();
  EXPECT_TRUE(cursor.ok()) << "no record at byte " << at;
  record.end = at + cursor.position();
  return record;
}

std::vector<Record> RecordsIn(absl::string_view bytes, std::size_t begin, std::size_t end) {
  std::vector<Record> records;
  for (std::size_t at = begin; at < end; at = records.back().end) {
    records.push_back(RecordAt(bytes, at));
  }
  return records;
}

std::string Unpacked(absl::string_view chunk) {
  ByteCursor cursor(chunk);
  cursor.Take(16);
  const auto size = cursor.Get<std::uint64_t>();
  const auto crc = cursor.Get<std::uint32_t>();
  const absl::string_view method = cursor.TakeSized<std::uint32_t>();
  std::string unpacked;
  EXPECT_THAT(Unpack(method, cursor.TakeSized<std::uint64_t>(), size, unpacked), IsOk());
  EXPECT_EQ(Crc(unpacked), crc);
  return unpacked;
}

using Written = std::pair<std::uint64_t, std::string>;  // time, bytes

class McapWriterTest : public ::testing::Test {
 protected:
  // Messages of two topics in no order, several chunks of them.
  McapWriterTest() {
    testing::Random random(5);
    McapWriter writer;
    const std::uint16_t topics[] = {writer.AddTopic("/a", kNumbers, "json"),
                                    writer.AddTopic("/b", kTexts, "json"),
                                    writer.AddTopic("/none", kTexts, "json")};
    for (int i = 0; i < 3000; ++i) {
      const std::uint16_t topic = topics[random.Bits() % 2];
      const std::uint64_t time_ns = 1'000 + random.Bits() % 100'000;
      const std::string bytes(random.Bits() % 2000, static_cast<char>('a' + i % 26));
      EXPECT_THAT(writer.AddMessage(topic, time_ns, bytes), IsOk());
      written_[topic].push_back({time_ns, bytes});
    }
    const absl::StatusOr<std::string> file = writer.Finish();
    EXPECT_THAT(file, IsOk());
    file_ = *file;
    ByteCursor footer(absl::string_view(file_).substr(file_.size() - kMagicBytes - 20));
    summary_ = footer.Get<std::uint64_t>();
    offsets_ = footer.Get<std::uint64_t>();
    summary_crc_ = footer.Get<std::uint32_t>();
  }

  std::string file_;
  std::map<std::uint16_t, std::vector<Written>> written_;
  std::uint64_t summary_ = 0, offsets_ = 0;
  std::uint32_t summary_crc_ = 0;
};

TEST_F(McapWriterTest, DataAndSummaryHaveTheirChecksums) {
  const std::size_t crc_at = file_.size() - kMagicBytes - 4;
  EXPECT_EQ(Crc(file_.substr(summary_, crc_at - summary_)), summary_crc_);
  const std::size_t data_end = summary_ - 9 - 4;
  const Record record = RecordAt(file_, data_end);
  EXPECT_EQ(record.op, 0x0F);
  EXPECT_EQ(ByteCursor(record.content).Get<std::uint32_t>(), Crc(file_.substr(0, data_end)));
}

// As a reader finds them that seeks: by the chunks' index, and the messages' in each.
TEST_F(McapWriterTest, EveryMessageIsFoundByTheIndexes) {
  std::map<std::uint16_t, std::vector<Written>> found;
  int chunks = 0;
  for (const Record& record : RecordsIn(file_, summary_, offsets_)) {
    if (record.op != 0x08) continue;
    ++chunks;
    ByteCursor index(record.content);
    const auto first_ns = index.Get<std::uint64_t>(), last_ns = index.Get<std::uint64_t>();
    const auto chunk_at = index.Get<std::uint64_t>(), length = index.Get<std::uint64_t>();
    const Record chunk = RecordAt(file_, chunk_at);
    ASSERT_EQ(chunk.op, 0x06);
    EXPECT_EQ(chunk.end, chunk_at + length);
    const std::string unpacked = Unpacked(chunk.content);
    ByteCursor offsets(index.TakeSized<std::uint32_t>());
    while (offsets.remaining() > 0) {
      const auto topic = offsets.Get<std::uint16_t>();
      const Record messages = RecordAt(file_, offsets.Get<std::uint64_t>());
      ASSERT_EQ(messages.op, 0x07);
      ByteCursor entries(messages.content);
      EXPECT_EQ(entries.Get<std::uint16_t>(), topic);
      ByteCursor list(entries.TakeSized<std::uint32_t>());
      while (list.remaining() > 0) {
        const auto time_ns = list.Get<std::uint64_t>();
        EXPECT_TRUE(time_ns >= first_ns && time_ns <= last_ns);
        const Record message = RecordAt(unpacked, list.Get<std::uint64_t>());
        ASSERT_EQ(message.op, 0x05);
        ByteCursor head(message.content);
        EXPECT_EQ(head.Get<std::uint16_t>(), topic);
        head.Get<std::uint32_t>();
        EXPECT_EQ(head.Get<std::uint64_t>(), time_ns);
        head.Get<std::uint64_t>();
        found[topic].push_back({time_ns, std::string(head.TakeRest())});
      }
    }
  }
  EXPECT_GT(chunks, 2);
  for (auto& [topic, messages] : written_) {
    EXPECT_THAT(found[topic], ::testing::UnorderedElementsAreArray(messages)) << topic;
  }
}

TEST_F(McapWriterTest, TheSummarySaysWhatThereIs) {
  for (const Record& record : RecordsIn(file_, summary_, offsets_)) {
    if (record.op != 0x0B) continue;
    ByteCursor statistics(record.content);
    EXPECT_EQ(statistics.Get<std::uint64_t>(), 3000U);
    EXPECT_EQ(statistics.Get<std::uint16_t>(), 2U);
    EXPECT_EQ(statistics.Get<std::uint32_t>(), 3U);
  }
  std::map<int, std::size_t> groups;  // by code, how many records
  const std::size_t footer = file_.size() - kMagicBytes - 4 - kFooterBytes;
  for (const Record& record : RecordsIn(file_, offsets_, footer)) {
    ASSERT_EQ(record.op, 0x0E);
    ByteCursor offset(record.content);
    const int op = offset.Get<std::uint8_t>();
    const auto begin = offset.Get<std::uint64_t>(), length = offset.Get<std::uint64_t>();
    for (const Record& one : RecordsIn(file_, begin, begin + length)) {
      EXPECT_EQ(one.op, op);
      ++groups[op];
    }
  }
  EXPECT_EQ(groups[0x03], 2U);
  EXPECT_EQ(groups[0x04], 3U);
  EXPECT_EQ(groups[0x0B], 1U);
  EXPECT_GT(groups[0x08], 2U);
}

}  // namespace
}  // namespace strata
