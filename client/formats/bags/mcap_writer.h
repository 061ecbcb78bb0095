// MCAP files (https://mcap.dev/spec) in memory: chunks packed with zstd, an index of them and of
// their messages, checksums of all.
#ifndef STRATA_CLIENT_FORMATS_BAGS_MCAP_WRITER_H_
#define STRATA_CLIENT_FORMATS_BAGS_MCAP_WRITER_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

struct McapSchema {
  absl::string_view name;      // "foxglove.PointCloud"
  absl::string_view encoding;  // of the text: "jsonschema"
  absl::string_view text;
};

// Not thread-safe.
class McapWriter {
 public:
  McapWriter();

  // The number of a topic whose messages are of `schema`, which outlives it, and in
  // `message_encoding` ("json"). At most 65,535 of them.
  std::uint16_t AddTopic(absl::string_view topic,
                         const McapSchema& schema,
                         absl::string_view message_encoding);
  // INTERNAL if zstd fails.
  absl::Status AddMessage(std::uint16_t topic, std::uint64_t time_ns, absl::string_view bytes);
  // The file. Nothing is added after it.
  absl::StatusOr<std::string> Finish();

 private:
  struct Topic {
    std::string record;        // of the channel
    std::uint16_t schema = 0;  // number
    bool written = false;      // to a chunk
    std::uint64_t messages = 0;
  };
  // A message's time, and where it begins in the unpacked chunk.
  using IndexEntry = std::pair<std::uint64_t, std::uint64_t>;

  std::uint16_t SchemaNumber(const McapSchema& schema);
  absl::Status FinishChunk();
  void AddSummary();

  std::string file_;
  std::vector<std::string> schemas_;  // their records; number 1 first
  std::map<absl::string_view, std::uint16_t> schema_numbers_;
  std::vector<Topic> topics_;
  std::string chunk_;
  std::map<std::uint16_t, std::vector<IndexEntry>> index_;  // of the chunk, by topic
  std::string chunk_indexes_;                               // their records
  std::uint64_t messages_ = 0;
  std::uint32_t chunks_ = 0;
  std::uint64_t first_ns_ = 0, last_ns_ = 0;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_MCAP_WRITER_H_
