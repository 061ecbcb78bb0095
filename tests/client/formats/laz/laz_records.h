// The records of a LAZ file's points, unpacked, as LAS would have them: all fields, also those that
// become nothing of a cloud.
#ifndef STRATA_TESTS_CLIENT_FORMATS_LAZ_LAZ_RECORDS_H_
#define STRATA_TESTS_CLIENT_FORMATS_LAZ_LAZ_RECORDS_H_

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/formats/laz/chunk_decoder.h"
#include "client/formats/laz/chunk_table.h"
#include "client/formats/laz/laz_format.h"
#include "client/formats/parsing/byte_source.h"
#include "client/formats/survey/las_header.h"
#include "client/formats/survey/las_units.h"
#include "core/common/status.h"

namespace strata::testing {

inline absl::StatusOr<std::string> RecordsOfLaz(absl::string_view file) {
  ByteSource source(file);
  STRATA_ASSIGN_OR_RETURN(const LasHeader header, ReadLasHeader(source));
  STRATA_ASSIGN_OR_RETURN(const std::vector<LasRecord> known, ReadLasRecords(source, header));
  const auto record =
      std::find_if(known.begin(), known.end(), [](const LasRecord& r) { return r.id == kLazId; });
  if (record == known.end()) return absl::NotFoundError("no record");
  STRATA_ASSIGN_OR_RETURN(const LazFormat format,
                          ReadLazFormat(record->bytes, header.format_number, header.point_bytes));
  STRATA_ASSIGN_OR_RETURN(const std::vector<LazChunk> chunks,
                          ReadChunkTable(source, header.points_at, header.points, format));
  ChunkDecoder decoder(format);
  std::string all;
  for (const LazChunk& chunk : chunks) {
    STRATA_RETURN_IF_ERROR(decoder.Start(
        file.substr(static_cast<std::size_t>(chunk.at), static_cast<std::size_t>(chunk.bytes))));
    std::string records(static_cast<std::size_t>(chunk.points) * header.point_bytes, '\0');
    decoder.Read(records);
    STRATA_RETURN_IF_ERROR(decoder.Finish());
    all += records;
  }
  return all;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CLIENT_FORMATS_LAZ_LAZ_RECORDS_H_
