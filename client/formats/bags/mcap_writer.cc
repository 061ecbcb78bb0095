#include "client/formats/bags/mcap_writer.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <zstd.h>

#include "client/formats/bags/mcap_records.h"
#include "core/common/status.h"

namespace strata {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kChunkBytes = std::size_t{1} << 20;
constexpr int kZstdLevel = 3;
constexpr char kCompression[] = "zstd";

// Fields in the order of the specification.
class Fields {
 public:
  template <typename Number>
  Fields& Put(Number number) {
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof(number));
    return *this;
  }
  // Behind its length, a number of type Length.
  template <typename Length>
  Fields& PutSized(absl::string_view bytes) {
    Put(static_cast<Length>(bytes.size()));
    bytes_.append(bytes.data(), bytes.size());
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string RecordOf(McapOp op, const std::string& content) {
  return Fields().Put(static_cast<std::uint8_t>(op)).PutSized<std::uint64_t>(content).bytes();
}

std::string RecordOf(McapOp op, const Fields& content) { return RecordOf(op, content.bytes()); }

}  // namespace

McapWriter::McapWriter() {
  file_ = std::string(kMcapMagic);
  file_ +=
      RecordOf(kMcapHeader, Fields().PutSized<std::uint32_t>("").PutSized<std::uint32_t>("strata"));
}

std::uint16_t McapWriter::SchemaNumber(const McapSchema& schema) {
  const auto number = static_cast<std::uint16_t>(schemas_.size() + 1);  // 0: none
  const auto [known, is_new] = schema_numbers_.try_emplace(schema.name, number);
  if (!is_new) return known->second;
  schemas_.push_back(RecordOf(kMcapSchema,
                              Fields()
                                  .Put(number)
                                  .PutSized<std::uint32_t>(schema.name)
                                  .PutSized<std::uint32_t>(schema.encoding)
                                  .PutSized<std::uint32_t>(schema.text)));
  return number;
}

std::uint16_t McapWriter::AddTopic(absl::string_view topic,
                                   const McapSchema& schema,
                                   absl::string_view message_encoding) {
  const auto number = static_cast<std::uint16_t>(topics_.size());
  Topic added;
  added.schema = SchemaNumber(schema);
  added.record = RecordOf(kMcapChannel,
                          Fields()
                              .Put(number)
                              .Put(added.schema)
                              .PutSized<std::uint32_t>(topic)
                              .PutSized<std::uint32_t>(message_encoding)
                              .PutSized<std::uint32_t>(""));  // metadata
  topics_.push_back(std::move(added));
  return number;
}

absl::Status McapWriter::AddMessage(std::uint16_t topic,
                                    std::uint64_t time_ns,
                                    absl::string_view bytes) {
  Topic& of = topics_[topic];
  if (!of.written) chunk_ += schemas_[of.schema - 1u] + of.record;
  of.written = true;
  index_[topic].push_back({time_ns, chunk_.size()});
  const std::string head = Fields()
                               .Put(topic)
                               .Put(static_cast<std::uint32_t>(of.messages))
                               .Put(time_ns)
                               .Put(time_ns)
                               .bytes();
  // In place: a message may have hundreds of megabytes.
  chunk_ += Fields()
                .Put(static_cast<std::uint8_t>(kMcapMessage))
                .Put(static_cast<std::uint64_t>(head.size() + bytes.size()))
                .bytes();
  chunk_ += head;
  chunk_.append(bytes.data(), bytes.size());
  first_ns_ = messages_ == 0 ? time_ns : std::min(first_ns_, time_ns);
  last_ns_ = messages_ == 0 ? time_ns : std::max(last_ns_, time_ns);
  ++of.messages;
  ++messages_;
  return chunk_.size() < kChunkBytes ? absl::OkStatus() : FinishChunk();
}

absl::Status McapWriter::FinishChunk() {
  if (chunk_.empty()) return absl::OkStatus();
  std::string packed(ZSTD_compressBound(chunk_.size()), '\0');
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), chunk_.data(), chunk_.size(), kZstdLevel);
  if (ZSTD_isError(size) != 0) {
    return absl::InternalError(absl::StrCat("zstd: ", ZSTD_getErrorName(size)));
  }
  packed.resize(size);
  std::uint64_t first_ns = index_.begin()->second.front().first, last_ns = first_ns;
  for (auto& [topic, entries] : index_) {
    std::sort(entries.begin(), entries.end());
    first_ns = std::min(first_ns, entries.front().first);
    last_ns = std::max(last_ns, entries.back().first);
  }
  const std::uint64_t begin = file_.size();
  file_ += RecordOf(kMcapChunk,
                    Fields()
                        .Put(first_ns)
                        .Put(last_ns)
                        .Put(static_cast<std::uint64_t>(chunk_.size()))
                        .Put(Crc32Of(chunk_))
                        .PutSized<std::uint32_t>(kCompression)
                        .PutSized<std::uint64_t>(packed));
  const std::uint64_t end = file_.size();
  Fields offsets;
  for (const auto& [topic, entries] : index_) {
    offsets.Put(topic).Put(static_cast<std::uint64_t>(file_.size()));
    Fields records;
    for (const IndexEntry& entry : entries) records.Put(entry.first).Put(entry.second);
    file_ +=
        RecordOf(kMcapMessageIndex, Fields().Put(topic).PutSized<std::uint32_t>(records.bytes()));
  }
  chunk_indexes_ += RecordOf(kMcapChunkIndex,
                             Fields()
                                 .Put(first_ns)
                                 .Put(last_ns)
                                 .Put(begin)
                                 .Put(end - begin)
                                 .PutSized<std::uint32_t>(offsets.bytes())
                                 .Put(static_cast<std::uint64_t>(file_.size()) - end)
                                 .PutSized<std::uint32_t>(kCompression)
                                 .Put(static_cast<std::uint64_t>(packed.size()))
                                 .Put(static_cast<std::uint64_t>(chunk_.size())));
  ++chunks_;
  chunk_.clear();
  index_.clear();
  return absl::OkStatus();
}

void McapWriter::AddSummary() {
  const std::uint64_t begin = file_.size();
  Fields counts;
  std::string schemas, topics, offsets;
  for (const std::string& schema : schemas_) schemas += schema;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    topics += topics_[i].record;
    counts.Put(static_cast<std::uint16_t>(i)).Put(topics_[i].messages);
  }
  const std::string statistics = RecordOf(kMcapStatistics,
                                          Fields()
                                              .Put(messages_)
                                              .Put(static_cast<std::uint16_t>(schemas_.size()))
                                              .Put(static_cast<std::uint32_t>(topics_.size()))
                                              .Put(std::uint32_t{0})  // attachments
                                              .Put(std::uint32_t{0})  // metadata
                                              .Put(chunks_)
                                              .Put(first_ns_)
                                              .Put(last_ns_)
                                              .PutSized<std::uint32_t>(counts.bytes()));
  for (const auto& [op, group] : {std::pair<McapOp, const std::string*>(kMcapSchema, &schemas),
                                  {kMcapChannel, &topics},
                                  {kMcapStatistics, &statistics},
                                  {kMcapChunkIndex, &chunk_indexes_}}) {
    if (group->empty()) continue;
    offsets += RecordOf(kMcapSummaryOffset,
                        Fields()
                            .Put(static_cast<std::uint8_t>(op))
                            .Put(static_cast<std::uint64_t>(file_.size()))
                            .Put(static_cast<std::uint64_t>(group->size())));
    file_ += *group;
  }
  const std::uint64_t offsets_at = file_.size();
  file_ += offsets;
  // The checksum is of all of the summary, and of the footer up to itself.
  std::string footer =
      RecordOf(kMcapFooter, Fields().Put(begin).Put(offsets_at).Put(std::uint32_t{0}));
  footer.resize(footer.size() - sizeof(std::uint32_t));
  file_ += footer;
  file_ += Fields().Put(Crc32Of(absl::string_view(file_).substr(begin))).bytes();
}

absl::StatusOr<std::string> McapWriter::Finish() {
  STRATA_RETURN_IF_ERROR(FinishChunk());
  file_ += RecordOf(kMcapDataEnd, Fields().Put(Crc32Of(file_)));
  AddSummary();
  file_.append(kMcapMagic.data(), kMcapMagic.size());
  return std::move(file_);
}

}  // namespace strata
