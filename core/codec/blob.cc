#include "core/codec/blob.h"

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/codec/bytes.h"
#include "core/common/checksum.h"

namespace strata {
namespace {

constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChecksumBytes = 8;
static_assert(kHeaderBytes + kChecksumBytes == kBlobOverheadBytes);

absl::string_view NameOf(BlobKind kind) {
  switch (kind) {
    case BlobKind::kSurfaceTile:
      return "surface tile";
    case BlobKind::kMlsTile:
      return "MLS tile";
    case BlobKind::kPoints:
      return "points";
    case BlobKind::kScanPlanes:
      return "planes of a scan";
    case BlobKind::kClassifier:
      return "classifier";
    case BlobKind::kLabels:
      return "labels";
    case BlobKind::kPlaneModel:
      return "plane model";
    case BlobKind::kModelPlane:
      return "plane of a model";
    case BlobKind::kEntities:
      return "entities";
    case BlobKind::kEntity:
      return "entity";
    case BlobKind::kInferredHead:
      return "inferred parts";
    case BlobKind::kInferred:
      return "inferred part";
    case BlobKind::kKindInfo:
      return "kind head";
    case BlobKind::kKindShape:
      return "kind shape";
    case BlobKind::kKindFile:
      return "kind file";
  }
  return "blob";
}

absl::Status Damaged(BlobKind kind, absl::string_view what) {
  return absl::DataLossError(absl::StrCat(NameOf(kind), ": ", what));
}

}  // namespace

std::string SealBlob(BlobKind kind, std::uint16_t version, absl::string_view body) {
  std::string blob;
  blob.reserve(body.size() + kBlobOverheadBytes);
  PutFixed(blob, static_cast<std::uint32_t>(kind));
  PutFixed(blob, version);
  PutFixed(blob, version);  // the oldest reader that understands it
  PutFixed(blob, static_cast<std::uint32_t>(body.size()));
  blob.append(body.data(), body.size());
  PutFixed(blob, Checksum64(blob));
  return blob;
}

absl::StatusOr<absl::string_view> OpenBlob(BlobKind kind,
                                           std::uint16_t reader_version,
                                           absl::string_view bytes) {
  if (bytes.size() < kBlobOverheadBytes) {
    return Damaged(kind, absl::StrCat(bytes.size(), " bytes, fewer than an empty one has"));
  }
  ByteReader reader(bytes);
  if (reader.Fixed<std::uint32_t>() != static_cast<std::uint32_t>(kind)) {
    return Damaged(kind, "does not begin with its magic number");
  }
  reader.Fixed<std::uint16_t>();  // the writer's version: for people
  const auto oldest_reader = reader.Fixed<std::uint16_t>();
  const auto body_size = reader.Fixed<std::uint32_t>();
  if (body_size != bytes.size() - kBlobOverheadBytes) {
    return Damaged(
        kind,
        absl::StrCat(
            "announces ", body_size, " bytes of content, has ", bytes.size() - kBlobOverheadBytes));
  }
  const absl::string_view body = reader.Take(body_size);
  if (reader.Fixed<std::uint64_t>() != Checksum64(bytes.substr(0, kHeaderBytes + body_size))) {
    return Damaged(kind, "checksum does not match");
  }
  if (oldest_reader > reader_version) {
    return absl::UnimplementedError(absl::StrCat(NameOf(kind),
                                                 ": needs a reader of version ",
                                                 oldest_reader,
                                                 ", this one has version ",
                                                 reader_version));
  }
  return body;
}

std::uint16_t VersionOfBlob(absl::string_view bytes) {
  constexpr std::size_t kOldestReader = 6;
  return ByteReader(bytes.substr(kOldestReader)).Fixed<std::uint16_t>();
}

}  // namespace strata
