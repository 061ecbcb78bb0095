#include "proto/translate/tiles.h"

#include <cstdint>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata::translate {
namespace {

using Kind = api::TileUpdate::Kind;
static_assert(v1::FetchTilesResponse::KIND_NEW == static_cast<int>(Kind::kNew));
static_assert(v1::FetchTilesResponse::KIND_CHANGED == static_cast<int>(Kind::kChanged));
static_assert(v1::FetchTilesResponse::KIND_GONE == static_cast<int>(Kind::kGone));
static_assert(v1::FetchTilesResponse::KIND_DAMAGED == static_cast<int>(Kind::kDamaged));

absl::Status CheckLevel(std::int32_t level) {
  if (level >= 0 && level <= kMaxLevel) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("tile level ", level, " is not in [0, ", kMaxLevel, "]"));
}

absl::Status CheckRange(const char* axis, std::int64_t min, std::int64_t max) {
  constexpr std::int64_t kBound = std::int64_t{1} << 31;
  if (min >= -kBound && max <= kBound && min <= max) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "area: ", axis, " from ", min, " to ", max, " is not a range within [-2^31, 2^31]"));
}

}  // namespace

v1::TileKey ToProto(const TileKey& key) {
  v1::TileKey proto;
  proto.set_level(key.level);
  proto.set_x(key.x);
  proto.set_y(key.y);
  return proto;
}

absl::StatusOr<TileKey> FromProto(const v1::TileKey& proto) {
  STRATA_RETURN_IF_ERROR(CheckLevel(proto.level()));
  return TileKey{proto.level(), proto.x(), proto.y()};
}

v1::EncodedTile ToProto(api::EncodedTile tile) {
  v1::EncodedTile proto;
  *proto.mutable_key() = ToProto(tile.key);
  proto.set_version(tile.version);
  proto.set_epoch(tile.epoch);
  proto.set_bytes(std::move(tile.bytes));
  return proto;
}

absl::StatusOr<api::EncodedTile> FromProto(const v1::EncodedTile& proto) {
  STRATA_ASSIGN_OR_RETURN(const TileKey key, FromProto(proto.key()));
  return api::EncodedTile{key, proto.version(), proto.epoch(), proto.bytes()};
}

v1::TileInfo ToProto(const api::TileInfo& tile) {
  v1::TileInfo proto;
  *proto.mutable_key() = ToProto(tile.key);
  proto.set_version(tile.version);
  proto.set_bytes(std::move(tile.bytes));
  proto.set_patches(tile.patches);
  return proto;
}

absl::StatusOr<api::TileInfo> FromProto(const v1::TileInfo& proto) {
  STRATA_ASSIGN_OR_RETURN(const TileKey key, FromProto(proto.key()));
  return api::TileInfo{key, proto.version(), proto.bytes(), proto.patches()};
}

v1::TileArea ToProto(const api::TileArea& area) {
  v1::TileArea proto;
  proto.set_level(area.level);
  proto.set_x_min(area.x_min);
  proto.set_x_max(area.x_max);
  proto.set_y_min(area.y_min);
  proto.set_y_max(area.y_max);
  proto.set_epoch(area.epoch);
  return proto;
}

absl::StatusOr<api::TileArea> FromProto(const v1::TileArea& proto) {
  api::TileArea area;
  area.level = proto.level();
  if (proto.has_x_min()) area.x_min = proto.x_min();
  if (proto.has_x_max()) area.x_max = proto.x_max();
  if (proto.has_y_min()) area.y_min = proto.y_min();
  if (proto.has_y_max()) area.y_max = proto.y_max();
  area.epoch = proto.epoch();
  STRATA_RETURN_IF_ERROR(CheckLevel(area.level));
  STRATA_RETURN_IF_ERROR(CheckRange("x", area.x_min, area.x_max));
  STRATA_RETURN_IF_ERROR(CheckRange("y", area.y_min, area.y_max));
  return area;
}

v1::HeldTile ToProto(const api::HeldTile& held) {
  v1::HeldTile proto;
  *proto.mutable_key() = ToProto(held.key);
  proto.set_version(held.version);
  return proto;
}

absl::StatusOr<api::HeldTile> FromProto(const v1::HeldTile& proto) {
  STRATA_ASSIGN_OR_RETURN(const TileKey key, FromProto(proto.key()));
  return api::HeldTile{key, proto.version()};
}

v1::FetchTilesResponse ToProto(const api::TileUpdate& update) {
  v1::FetchTilesResponse proto;
  proto.set_kind(static_cast<v1::FetchTilesResponse::Kind>(update.kind));
  *proto.mutable_tile() = ToProto(update.tile);
  return proto;
}

absl::StatusOr<api::TileUpdate> FromProto(const v1::FetchTilesResponse& proto) {
  if (!v1::FetchTilesResponse::Kind_IsValid(proto.kind()) ||
      proto.kind() == v1::FetchTilesResponse::KIND_UNSPECIFIED) {
    return absl::InvalidArgumentError(absl::StrCat(
        "kind: ", static_cast<int>(proto.kind()), " is not new, changed, gone or damaged"));
  }
  STRATA_ASSIGN_OR_RETURN(api::EncodedTile tile, FromProto(proto.tile()));
  return api::TileUpdate{static_cast<Kind>(proto.kind()), std::move(tile)};
}

}  // namespace strata::translate
