#include "client/formats/survey/las_reader.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/laz/chunk_decoder.h"
#include "client/formats/laz/chunk_table.h"
#include "client/formats/laz/laz_format.h"
#include "client/formats/parsing/byte_source.h"
#include "client/formats/survey/las_header.h"
#include "client/formats/survey/las_points.h"
#include "client/formats/survey/las_units.h"
#include "core/cloud/point_cloud.h"
#include "core/common/status.h"

namespace strata {
namespace {

absl::Status AddPlain(ByteSource& source, const LasHeader& header, LasPoints& points) {
  std::string records;
  std::uint64_t at = header.points_at;
  for (std::uint64_t left = header.points; left > 0;) {
    const auto count = std::min<std::uint64_t>(left, LasPoints::kMostAtOnce);
    STRATA_RETURN_IF_ERROR(source.Read(at, count * header.point_bytes, records));
    points.Add(records);
    at += records.size();
    left -= count;
  }
  return absl::OkStatus();
}

absl::StatusOr<LazFormat> LazFormatOf(const LasHeader& header,
                                      const std::vector<LasRecord>& records) {
  const auto record = std::find_if(records.begin(), records.end(), [](const LasRecord& r) {
    return r.user == kLazUser && r.id == kLazId;
  });
  if (record != records.end()) {
    return ReadLazFormat(record->bytes, header.format_number, header.point_bytes);
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "the points are compressed, but no record '", kLazUser, "' ", kLazId, " says how"));
}

absl::Status AddChunk(ByteSource& source,
                      const LazChunk& chunk,
                      const LasHeader& header,
                      ChunkDecoder& decoder,
                      LasPoints& points) {
  std::string bytes;
  STRATA_RETURN_IF_ERROR(source.Read(chunk.at, chunk.bytes, bytes));
  STRATA_RETURN_IF_ERROR(decoder.Start(bytes));
  std::string records;
  for (std::uint64_t left = chunk.points; left > 0;) {
    const auto count = std::min<std::uint64_t>(left, LasPoints::kMostAtOnce);
    records.resize(static_cast<std::size_t>(count) * header.point_bytes);
    decoder.Read(records);
    points.Add(records);
    left -= count;
  }
  return decoder.Finish();
}

absl::Status AddCompressed(ByteSource& source,
                           const LasHeader& header,
                           const std::vector<LasRecord>& records,
                           LasPoints& points) {
  STRATA_ASSIGN_OR_RETURN(const LazFormat format, LazFormatOf(header, records));
  STRATA_ASSIGN_OR_RETURN(const std::vector<LazChunk> chunks,
                          ReadChunkTable(source, header.points_at, header.points, format));
  // More points than bytes there are hardly ever.
  points.Reserve(static_cast<std::size_t>(std::min(header.points, source.size())));
  ChunkDecoder decoder(format);
  for (const LazChunk& chunk : chunks) {
    const absl::Status added = AddChunk(source, chunk, header, decoder, points);
    if (!added.ok()) return Annotate(added, absl::StrCat("byte ", chunk.at));
  }
  return absl::OkStatus();
}

absl::StatusOr<PointCloud> ReadLasOf(ByteSource& source) {
  STRATA_ASSIGN_OR_RETURN(const LasHeader header, ReadLasHeader(source));
  STRATA_ASSIGN_OR_RETURN(const std::vector<LasRecord> records, ReadLasRecords(source, header));
  STRATA_ASSIGN_OR_RETURN(const LasUnits units, LasUnitsOf(records, header.text_projection));
  STRATA_ASSIGN_OR_RETURN(LasPoints points, LasPoints::Create(header, units));
  if (header.compressed) {
    STRATA_RETURN_IF_ERROR(AddCompressed(source, header, records, points));
  } else {
    points.Reserve(static_cast<std::size_t>(header.points));
    STRATA_RETURN_IF_ERROR(AddPlain(source, header, points));
  }
  return std::move(points).Build();
}

}  // namespace

absl::StatusOr<PointCloud> ReadLas(absl::string_view bytes) {
  ByteSource source(bytes);
  return ReadLasOf(source);
}

absl::StatusOr<PointCloud> ReadLasFile(const std::filesystem::path& path) {
  STRATA_ASSIGN_OR_RETURN(ByteSource source, ByteSource::Open(path));
  return ReadLasOf(source);
}

}  // namespace strata
