#include "core/completion/kind_codec.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/common/checksum.h"
#include "core/common/status.h"
#include "core/world/map_class.h"
#include "core/world/names.h"

namespace strata {
namespace {

constexpr std::uint16_t kKindVersion = 1;
constexpr std::uint64_t kIdBits = (std::uint64_t{1} << 48) - 1;
constexpr std::size_t kPlaceBytes = 3 * 4;
constexpr std::size_t kMostNameBytes = 100;

absl::Status DamagedKind(absl::string_view why) {
  return absl::DataLossError(absl::StrCat("kind: ", why));
}

void PutPlaces(std::string& out, const std::vector<Eigen::Vector3f>& places) {
  PutFixed(out, static_cast<std::uint32_t>(places.size()));
  for (const Eigen::Vector3f& p : places) {
    for (const float x : p) PutFixed(out, std::bit_cast<std::uint32_t>(x));
  }
}

// False where there are more than `most`, or fewer bytes than they take.
bool TakePlaces(ByteReader& in, std::size_t most, std::vector<Eigen::Vector3f>& places) {
  const auto count = in.Fixed<std::uint32_t>();
  if (count > most || count > in.remaining() / kPlaceBytes) return false;
  places.resize(count);
  for (Eigen::Vector3f& p : places) {
    for (float& x : p) x = std::bit_cast<float>(in.Fixed<std::uint32_t>());
  }
  return true;
}

bool TakeTriangles(ByteReader& in, std::vector<std::array<std::uint32_t, 3>>& triangles) {
  const auto count = in.Fixed<std::uint32_t>();
  if (count > kMaxKindTriangles || count > in.remaining() / kPlaceBytes) return false;
  triangles.resize(count);
  for (auto& triangle : triangles) {
    for (std::uint32_t& vertex : triangle) vertex = in.Fixed<std::uint32_t>();
  }
  return true;
}

void PutText(std::string& out, absl::string_view text) {
  PutFixed(out, static_cast<std::uint16_t>(text.size()));
  out.append(text.data(), text.size());
}

absl::string_view TakeText(ByteReader& in) {
  const auto size = in.Fixed<std::uint16_t>();
  return in.Take(size > kMostNameBytes ? in.remaining() + 1 : size);
}

bool IsSoundKind(const KindInfo& info) {
  const bool sized =
      (info.size.array() >= 0.0).all() && (info.size.array() <= 4.0 * kMaxKindExtentM).all();
  return info.id > 0 && info.id <= kIdBits && info.class_id > 0 && info.class_id <= kMaxClassId &&
         sized && info.origin >= KindOrigin::kFound && info.origin <= KindOrigin::kImported;
}

std::string BodyOf(const KindShape& shape) {
  std::string body;
  PutPlaces(body, shape.points);
  PutPlaces(body, shape.vertices);
  PutFixed(body, static_cast<std::uint32_t>(shape.triangles.size()));
  for (const auto& triangle : shape.triangles) {
    for (const std::uint32_t vertex : triangle) PutFixed(body, vertex);
  }
  return body;
}

absl::StatusOr<KindShape> TakeShape(ByteReader& in) {
  KindShape shape;
  if (!TakePlaces(in, kMaxKindPoints, shape.points) ||
      !TakePlaces(in, kMaxKindVertices, shape.vertices) || !TakeTriangles(in, shape.triangles) ||
      !in.ok() || in.remaining() != 0) {
    return DamagedKind("its shape is too large or cut short");
  }
  const absl::Status valid = ValidateKindShape(shape);
  if (!valid.ok()) return absl::DataLossError(valid.message());
  return shape;
}

}  // namespace

std::string EncodeKindInfo(const KindInfo& info) {
  std::string body;
  PutFixed(body, info.id);
  PutFixed(body, info.class_id);
  PutFixed(body, static_cast<std::uint8_t>(info.origin));
  PutFixed(body, absl::ToUnixMicros(info.made));
  for (const double x : info.size) PutFixed(body, std::bit_cast<std::uint64_t>(x));
  PutFixed(body, info.points);
  PutFixed(body, info.triangles);
  return SealBlob(BlobKind::kKindInfo, kKindVersion, body);
}

absl::StatusOr<KindInfo> DecodeKindInfo(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kKindInfo, kKindVersion, bytes));
  ByteReader in(body);
  KindInfo info;
  info.id = in.Fixed<std::uint64_t>();
  info.class_id = in.Fixed<std::uint16_t>();
  info.origin = static_cast<KindOrigin>(in.Fixed<std::uint8_t>());
  info.made = absl::FromUnixMicros(in.Fixed<std::int64_t>());
  for (double& x : info.size) x = std::bit_cast<double>(in.Fixed<std::uint64_t>());
  info.points = in.Fixed<std::uint64_t>();
  info.triangles = in.Fixed<std::uint64_t>();
  if (!in.ok() || in.remaining() != 0 || !IsSoundKind(info)) {
    return DamagedKind("its head is out of range or cut short");
  }
  return info;
}

std::string EncodeKindShape(const KindShape& shape) {
  return SealBlob(BlobKind::kKindShape, kKindVersion, BodyOf(shape));
}

absl::StatusOr<KindShape> DecodeKindShape(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kKindShape, kKindVersion, bytes));
  ByteReader in(body);
  return TakeShape(in);
}

std::string EncodeKindFile(const NewKind& kind) {
  std::string body;
  PutText(body, kind.name);
  PutText(body, kind.class_name);
  body += BodyOf(kind.shape);
  return SealBlob(BlobKind::kKindFile, kKindVersion, body);
}

absl::StatusOr<NewKind> DecodeKindFile(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kKindFile, kKindVersion, bytes));
  ByteReader in(body);
  NewKind kind;
  kind.name = std::string(TakeText(in));
  kind.class_name = std::string(TakeText(in));
  const bool named = kind.name.empty() || ValidateName("kind name", kind.name).ok();
  if (!in.ok() || !named || !ValidateName("class name", kind.class_name).ok()) {
    return DamagedKind("its names are damaged");
  }
  STRATA_ASSIGN_OR_RETURN(kind.shape, TakeShape(in));
  return kind;
}

std::uint64_t KindIdOf(const KindShape& shape) {
  const std::uint64_t id = Checksum64(BodyOf(shape)) & kIdBits;
  return id == 0 ? 1 : id;
}

}  // namespace strata
