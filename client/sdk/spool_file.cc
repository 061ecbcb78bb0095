#include "client/sdk/spool_file.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/api/chunk_check.h"
#include "core/cloud/cloud_slice.h"
#include "core/codec/bytes.h"
#include "core/codec/point_codec.h"
#include "core/common/checksum.h"
#include "core/common/status.h"
#include "core/world/names.h"
#include "core/world/value_codec.h"

namespace strata::sdk {
namespace {

constexpr absl::string_view kMagic = "STRSPOOL";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kMaxHeadBytes = 4096;
constexpr std::size_t kMaxPieceBytes = std::size_t{1} << 20;

void PutText(std::string& out, absl::string_view text) {
  PutFixed(out, static_cast<std::uint16_t>(text.size()));
  out.append(text.data(), text.size());
}

std::string GetText(ByteReader& reader) {
  return std::string(reader.Take(reader.Fixed<std::uint16_t>()));
}

std::string EncodeHead(const SpooledScan& scan) {
  std::string head;
  PutText(head, scan.map);
  PutText(head, scan.header.id.trajectory);
  PutText(head, scan.header.content_hash);
  PutFixed(head, scan.header.id.sequence);
  head += EncodeScanHeader(scan.header);
  return head;
}

absl::StatusOr<SpooledScan> DecodeHead(absl::string_view bytes) {
  ByteReader reader(bytes);
  SpooledScan scan;
  scan.map = GetText(reader);
  ScanId id;
  id.trajectory = GetText(reader);
  std::string hash = GetText(reader);
  id.sequence = reader.Fixed<std::uint64_t>();
  if (!reader.ok()) return absl::DataLossError("head: cut short");
  STRATA_ASSIGN_OR_RETURN(scan.header, DecodeScanHeader(id, reader.Take(reader.remaining())));
  scan.header.content_hash = std::move(hash);
  absl::Status sound = ValidateName("map name", scan.map);
  if (sound.ok()) sound = ValidateScanHeader(scan.header);
  if (sound.ok() && scan.header.content_hash.empty()) sound = absl::DataLossError("no hash");
  if (!sound.ok()) return absl::DataLossError(absl::StrCat("head: ", sound.message()));
  return scan;
}

// nullopt if there are fewer bytes left.
std::optional<std::string> ReadBytes(std::ifstream& stream, std::size_t size) {
  std::string bytes(size, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::size_t>(stream.gcount()) != size) return std::nullopt;
  return bytes;
}

}  // namespace

absl::StatusOr<std::string> EncodeSpoolFile(const SpooledScan& scan, const PointCloud& cloud) {
  std::string bytes(kMagic);
  PutFixed(bytes, kVersion);
  const std::string head = EncodeHead(scan);
  PutFixed(bytes, static_cast<std::uint32_t>(head.size()));
  bytes += head;
  PutFixed(bytes, Checksum64(bytes));
  for (std::size_t begin = 0; begin < cloud.size(); begin += kMaxEncodedPoints) {
    STRATA_ASSIGN_OR_RETURN(
        const std::string piece,
        EncodePoints(SliceOf(cloud, begin, std::min(cloud.size(), begin + kMaxEncodedPoints))));
    PutFixed(bytes, static_cast<std::uint32_t>(piece.size()));
    bytes += piece;
  }
  return bytes;
}

absl::StatusOr<SpoolFileReader> SpoolFileReader::Open(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return absl::NotFoundError(absl::StrCat("cannot read ", file.string()));
  SpoolFileReader reader(std::move(stream));
  STRATA_RETURN_IF_ERROR(Annotate(reader.ReadHead(), file.filename().string()));
  return reader;
}

absl::Status SpoolFileReader::ReadHead() {
  constexpr std::size_t kFrontBytes = 16;
  std::optional<std::string> front = ReadBytes(stream_, kFrontBytes);
  if (!front.has_value() || absl::string_view(*front).substr(0, kMagic.size()) != kMagic) {
    return absl::DataLossError("no file of a spool");
  }
  ByteReader numbers(absl::string_view(*front).substr(kMagic.size()));
  const auto version = numbers.Fixed<std::uint32_t>();
  if (version != kVersion) {
    return absl::UnimplementedError(absl::StrCat(
        "version ", version, " of the format; this program reads ", kVersion, ": update it"));
  }
  const auto head_bytes = numbers.Fixed<std::uint32_t>();
  if (head_bytes > kMaxHeadBytes) return absl::DataLossError("head: absurd length");
  const std::optional<std::string> head = ReadBytes(stream_, head_bytes);
  const std::optional<std::string> sum = ReadBytes(stream_, 8);
  if (!head.has_value() || !sum.has_value()) return absl::DataLossError("head: cut short");
  if (ByteReader(*sum).Fixed<std::uint64_t>() != Checksum64(*front + *head)) {
    return absl::DataLossError("head: checksum mismatch");
  }
  STRATA_ASSIGN_OR_RETURN(scan_, DecodeHead(*head));
  return absl::OkStatus();
}

absl::StatusOr<std::optional<PointCloud>> SpoolFileReader::Next() {
  if (points_ == scan_.header.point_count) {
    if (stream_.peek() != std::ifstream::traits_type::eof()) {
      return absl::DataLossError("more than the scan");
    }
    return std::nullopt;
  }
  const std::optional<std::string> length = ReadBytes(stream_, 4);
  const std::size_t size = length.has_value() ? ByteReader(*length).Fixed<std::uint32_t>() : 0;
  if (size == 0 || size > kMaxPieceBytes) {
    return absl::DataLossError(absl::StrCat("piece behind point ", points_, ": no sound length"));
  }
  const std::optional<std::string> bytes = ReadBytes(stream_, size);
  if (!bytes.has_value()) {
    return absl::DataLossError(absl::StrCat("piece behind point ", points_, ": cut short"));
  }
  STRATA_ASSIGN_OR_RETURN(PointCloud piece, DecodePoints(*bytes));
  if (const absl::Status sound = api::CheckChunk(piece, scan_.header, points_); !sound.ok()) {
    return absl::DataLossError(sound.message());
  }
  points_ += piece.size();
  return piece;
}

}  // namespace strata::sdk
