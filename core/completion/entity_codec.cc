#include "core/completion/entity_codec.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include <Eigen/Core>

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/common/status.h"
#include "core/geometry/pose.h"

namespace strata {
namespace {

constexpr std::uint16_t kEntitiesVersion = 1;
constexpr std::uint16_t kEntityVersion = 2;  // 1 had no kinds
constexpr double kMostEntityNumber = 1e15;
constexpr std::size_t kReachBytes = 2 + 8;

void PutNumber(std::string& out, double value) {
  PutFixed(out, std::bit_cast<std::uint64_t>(value));
}

void PutVector(std::string& out, const Eigen::Vector3d& v) {
  for (const double x : v) PutNumber(out, x);
}

// NaN where it is out of range, which CheckEntity() sees.
double TakeNumber(ByteReader& in) {
  const double value = std::bit_cast<double>(in.Fixed<std::uint64_t>());
  return std::abs(value) <= kMostEntityNumber ? value : std::nan("");
}

Eigen::Vector3d TakeVector(ByteReader& in) {
  const double x = TakeNumber(in), y = TakeNumber(in), z = TakeNumber(in);
  return {x, y, z};
}

absl::Status DamagedEntity(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("entities: ", what, " is out of range or cut short"));
}

bool IsSound(const Entity& entity) {
  const UprightBox& box = entity.box;
  return entity.class_id != 0 && box.centre.allFinite() && box.size.allFinite() &&
         (box.size.array() >= 0.0).all() && std::isfinite(box.yaw_rad) && entity.radius_m >= 0.0;
}

void PutKind(std::string& out, const std::optional<EntityKind>& kind) {
  PutFixed(out, kind.has_value() ? kind->id : std::uint64_t{0});
  if (!kind.has_value()) return;
  const Eigen::Matrix<double, 3, 4> T = kind->T_map_kind.affine();
  for (Eigen::Index i = 0; i < T.size(); ++i) PutNumber(out, T(i / 4, i % 4));
  PutNumber(out, kind->residual_m);
  PutNumber(out, kind->overlap);
}

// False where it is no kind.
bool TakeKind(ByteReader& in, std::optional<EntityKind>& kind) {
  const auto id = in.Fixed<std::uint64_t>();
  if (id == 0) return true;
  kind.emplace().id = id;
  for (Eigen::Index i = 0; i < 12; ++i) {
    kind->T_map_kind.matrix()(i / 4, i % 4) = TakeNumber(in);
  }
  kind->residual_m = TakeNumber(in);
  kind->overlap = TakeNumber(in);
  return kind->residual_m >= 0.0 && kind->overlap >= 0.0 && kind->overlap <= 1.0 &&
         ValidatePose(kind->T_map_kind, kMostEntityNumber).ok();
}

}  // namespace

std::string EncodeEntitiesInfo(const EntitiesInfo& info) {
  std::string body;
  PutVarint(body, info.job);
  PutVarint(body, info.epoch);
  PutFixed(body, absl::ToUnixMicros(info.made));
  PutVarint(body, info.scans);
  PutVarint(body, info.points);
  PutVarint(body, info.entities);
  PutVarint(body, info.reaches.size());
  for (const ClassReach& reach : info.reaches) {
    PutFixed(body, reach.class_id);
    PutNumber(body, reach.distance_m);
  }
  return SealBlob(BlobKind::kEntities, kEntitiesVersion, body);
}

absl::StatusOr<EntitiesInfo> DecodeEntitiesInfo(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kEntities, kEntitiesVersion, bytes));
  ByteReader in(body);
  EntitiesInfo info;
  info.job = in.Varint();
  info.epoch = in.Varint();
  info.made = absl::FromUnixMicros(in.Fixed<std::int64_t>());
  info.scans = in.Varint();
  info.points = in.Varint();
  info.entities = in.Varint();
  const std::uint64_t reaches = in.Varint();
  if (reaches > in.remaining() / kReachBytes) return DamagedEntity("their head");
  for (std::uint64_t i = 0; i < reaches; ++i) {
    ClassReach reach;
    reach.class_id = in.Fixed<std::uint16_t>();
    reach.distance_m = TakeNumber(in);
    if (!(reach.distance_m >= 0.0)) return DamagedEntity("their head");
    info.reaches.push_back(reach);
  }
  if (!in.ok() || in.remaining() != 0) return DamagedEntity("their head");
  return info;
}

std::string EncodeEntity(const StoredEntity& stored) {
  const Entity& entity = stored.entity;
  std::string body;
  PutVarint(body, entity.id);
  PutFixed(body, entity.class_id);
  PutVector(body, entity.box.centre);
  PutVector(body, entity.box.size);
  PutNumber(body, entity.box.yaw_rad);
  PutNumber(body, entity.radius_m);
  PutVarint(body, stored.scans.size());
  for (const StoredEntity::Seen& seen : stored.scans) {
    PutVarint(body, seen.scan);
    PutVarint(body, seen.points);
  }
  PutKind(body, entity.kind);
  return SealBlob(BlobKind::kEntity, kEntityVersion, body);
}

absl::StatusOr<StoredEntity> DecodeEntity(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kEntity, kEntityVersion, bytes));
  ByteReader in(body);
  StoredEntity stored;
  Entity& entity = stored.entity;
  entity.id = in.Varint();
  entity.class_id = in.Fixed<std::uint16_t>();
  entity.box.centre = TakeVector(in);
  entity.box.size = TakeVector(in);
  entity.box.yaw_rad = TakeNumber(in);
  entity.radius_m = TakeNumber(in);
  const std::uint64_t scans = in.Varint();
  if (scans > in.remaining() / 2) return DamagedEntity("an entity");
  for (std::uint64_t i = 0; i < scans; ++i) {
    const std::uint64_t scan = in.Varint();
    stored.scans.push_back({scan, in.Varint()});
    entity.points += stored.scans.back().points;
  }
  const bool has_kind = VersionOfBlob(bytes) >= 2;
  if (has_kind && !TakeKind(in, entity.kind)) return DamagedEntity("an entity's kind");
  if (!in.ok() || in.remaining() != 0 || !IsSound(entity)) return DamagedEntity("an entity");
  return stored;
}

}  // namespace strata
