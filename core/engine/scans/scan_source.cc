#include "core/engine/scans/scan_source.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/codec/local_map_codec.h"
#include "core/codec/point_codec.h"
#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/mls/build.h"
#include "core/mls/join.h"
#include "core/mls/patch.h"
#include "core/mls/sides.h"
#include "core/mls/tile_key.h"
#include "core/registration/upright_frame.h"
#include "core/registration/upright_offsets.h"

namespace strata {
namespace {

constexpr std::size_t kBlockPoints = 1'000'000;
constexpr std::size_t kAnyPatches = std::numeric_limits<std::size_t>::max();

absl::Status CheckPatches(const MlsMap& map, std::size_t most) {
  std::size_t patches = 0;
  for (const MlsTile& tile : map.tiles) patches += tile.patches.size();
  if (patches <= most) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "more than ", most, " surface patches, the most of one scan; split it, or use larger cells"));
}

template <typename T>
void AppendTo(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

void AppendPiece(const PointCloud& piece, PointCloud& block) {
  AppendTo(block.points, piece.points);
  AppendTo(block.intensity, piece.intensity);
  AppendTo(block.colour, piece.colour);
  AppendTo(block.label, piece.label);
}

// Tiles in which a sensor may have points.
using TilePlaces = HashSet<std::pair<std::int64_t, std::int64_t>>;

void AddTiles(const PointCloud& block,
              const SensorModel& sensor,
              double tile_m,
              TilePlaces& tiles) {
  for (const Eigen::Vector3f& p : block.points) {
    if (!((p - block.sensor_origin).norm() <= sensor.max_range_m)) continue;
    tiles.insert({static_cast<std::int64_t>(std::floor(p.x() / tile_m)),
                  static_cast<std::int64_t>(std::floor(p.y() / tile_m))});
  }
}

// The points of `block` that have not faded.
PointCloud Lasting(const PointCloud& block, const std::vector<std::uint16_t>& faded) {
  PointCloud lasting;
  lasting.sensor_origin = block.sensor_origin;
  const auto keep = [&](const auto& from, auto& to) {
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (faded[i] == 0) to.push_back(from[i]);
    }
  };
  keep(block.points, lasting.points);
  keep(block.intensity, lasting.intensity);
  keep(block.colour, lasting.colour);
  keep(block.label, lasting.label);
  return lasting;
}

// Robots send local maps without, and so did servers of before.
bool HasSides(const MlsMap& map) {
  return std::any_of(map.tiles.begin(), map.tiles.end(), [](const MlsTile& tile) {
    return std::any_of(tile.patches.begin(), tile.patches.end(), [](const Patch& patch) {
      return patch.sides != 0;
    });
  });
}

// Pieces are joined column by column, so one without a column that others have would shift it.
bool HasColumnsOf(const ScanHeader& header, const PointCloud& piece) {
  return piece.intensity.empty() != header.has_intensity &&
         piece.colour.empty() != header.has_colour && piece.label.empty() != header.has_label;
}

}  // namespace

absl::StatusOr<PointCloud> ReadPoints(StorageReader& reader,
                                      const ScanRecord& scan,
                                      std::uint32_t ordinal) {
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, reader.GetChunk(scan.upload, ordinal));
  absl::StatusOr<PointCloud> piece = DecodePoints(bytes);
  if (!piece.ok()) return Annotate(piece.status(), absl::StrCat("piece ", ordinal));
  if (piece->size() > 0 && HasColumnsOf(scan.header, *piece)) return piece;
  return absl::DataLossError(
      absl::StrCat("piece ", ordinal, ": columns are not those that the header announces"));
}

absl::Status ScanSource::ForEachBlock(const ScanRecord& scan,
                                      absl::FunctionRef<absl::Status(const PointCloud&)> body) {
  if (held_scan_ == scan.number && scan.number != 0) return body(held_);
  held_scan_ = 0;
  const auto begin_block = [&] {
    held_ = PointCloud();
    held_.sensor_origin = scan.header.sensor_origin;
    held_.points.reserve(
        std::min<std::uint64_t>(scan.header.point_count, kBlockPoints + kMaxEncodedPoints));
    held_faded_.clear();
  };
  begin_block();
  ScanLabels labels(scan, labels_);
  for (std::uint32_t ordinal = 0; ordinal < scan.chunks; ++ordinal) {
    if (held_.size() >= kBlockPoints) {
      STRATA_RETURN_IF_ERROR(body(held_));
      begin_block();
    }
    STRATA_ASSIGN_OR_RETURN(PointCloud piece, ReadPoints(reader_, scan, ordinal));
    STRATA_RETURN_IF_ERROR(labels.Apply(reader_, piece));
    STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> faded,
                            labels.Faded(reader_, piece.size()));
    AppendPiece(piece, held_);
    AppendTo(held_faded_, faded);
  }
  if (held_.size() == scan.header.point_count) held_scan_ = scan.number;
  return body(held_);
}

absl::StatusOr<MlsMap> ScanSource::Build(const ScanRecord& scan,
                                         const Pose& T_map_scan,
                                         const MlsParameters& parameters,
                                         Faded faded,
                                         std::size_t most_patches) {
  const SensorModel sensor = scan.header.sensor.value_or(parameters_.sensor);
  MlsMap map;
  map.parameters = parameters;
  dropped_ = DroppedPoints();
  STRATA_RETURN_IF_ERROR(ForEachBlock(scan, [&](const PointCloud& block) -> absl::Status {
    const bool all = faded == Faded::kWith || held_faded_.empty();
    STRATA_ASSIGN_OR_RETURN(
        MlsBuildResult built,
        BuildMlsMap(
            all ? block : Lasting(block, held_faded_), T_map_scan, sensor, parameters, scratch_));
    dropped_.not_finite += built.dropped.not_finite;
    dropped_.out_of_range += built.dropped.out_of_range;
    dropped_.outside_map += built.dropped.outside_map;
    if (map.tiles.empty()) {
      map = std::move(built.map);
    } else {
      JoinInto(map, built.map);
    }
    return CheckPatches(map, most_patches);
  }));
  MarkSides(T_map_scan * scan.header.sensor_origin.cast<double>(), map);
  return map;
}

absl::Status ScanSource::CheckSpread(const ScanRecord& scan) {
  const double tile_m = parameters_.mls.cell_size_m * kTileCells;
  const Eigen::Array2d box_tiles =
      (scan.box_scan.sizes().head<2>().cast<double>() / tile_m).array() + 1.0;
  // Only a scan with so large a box is looked at point by point.
  if (scan.box_scan.isEmpty() || box_tiles.prod() <= static_cast<double>(kMaxScanTiles)) {
    return absl::OkStatus();
  }
  const SensorModel sensor = scan.header.sensor.value_or(parameters_.sensor);
  TilePlaces tiles;
  return ForEachBlock(scan, [&](const PointCloud& block) -> absl::Status {
    AddTiles(block, sensor, tile_m, tiles);
    if (tiles.size() <= kMaxScanTiles) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat("points in more than ",
                     kMaxScanTiles,
                     " tiles of ",
                     tile_m,
                     " m, the most of one scan; set the sensor's max range, or split the scan"));
  });
}

absl::StatusOr<MlsMap> ScanSource::LocalMap(const ScanRecord& scan) {
  if (scan.has_points) {
    STRATA_RETURN_IF_ERROR(CheckSpread(scan));
    const bool waits = scan.state == ScanState::kPending;  // what was taken once is taken
    return Build(scan,
                 Pose::Identity(),
                 parameters_.mls,
                 Faded::kWith,
                 waits ? kMaxScanPatches : kAnyPatches);
  }
  dropped_ = DroppedPoints();
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, reader_.GetLocalMap(scan.number));
  STRATA_ASSIGN_OR_RETURN(MlsMap map, DecodeLocalMap(bytes, parameters_.mls));
  if (!HasSides(map)) MarkSides(scan.header.sensor_origin.cast<double>(), map);
  return map;
}

absl::StatusOr<Eigen::Vector3d> ScanSource::UpIn(const ScanRecord& scan) {
  if (!scan.has_points || !parameters_.keep_points) return Eigen::Vector3d::UnitZ();
  if (up_scan_ == scan.number) return up_;
  up_scan_ = 0;
  up_ = UpOf(scan.header.T_map_scan);
  if (!UprightTurn(up_).isIdentity(0.0)) {
    bool is_first = true;  // which is enough of a large scan
    STRATA_RETURN_IF_ERROR(ForEachBlock(scan, [&](const PointCloud& block) {
      if (std::exchange(is_first, false)) up_ = BelievedUp(block.points, up_);
      return absl::OkStatus();
    }));
  }
  up_scan_ = scan.number;
  return up_;
}

absl::StatusOr<Eigen::Matrix3d> ScanSource::TurnOf(const ScanRecord& scan) {
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d up, UpIn(scan));
  return UprightTurn(up);
}

absl::StatusOr<bool> ScanSource::IsMatchedOtherwise(const ScanRecord& scan) {
  if (scan.has_points && parameters_.mls.cell_size_m > kRegistrationCellM) return true;
  STRATA_ASSIGN_OR_RETURN(const Eigen::Matrix3d R_upright_scan, TurnOf(scan));
  return !R_upright_scan.isIdentity(0.0);
}

absl::StatusOr<MlsMap> ScanSource::RegistrationMap(const ScanRecord& scan) {
  STRATA_ASSIGN_OR_RETURN(const bool otherwise, IsMatchedOtherwise(scan));
  if (!otherwise) return LocalMap(scan);
  STRATA_RETURN_IF_ERROR(CheckSpread(scan));
  STRATA_ASSIGN_OR_RETURN(const Eigen::Matrix3d R_upright_scan, TurnOf(scan));
  MlsParameters finer = parameters_.mls;
  finer.cell_size_m = std::min(finer.cell_size_m, kRegistrationCellM);
  return Build(scan, Pose(R_upright_scan), finer, Faded::kWith, kMaxScanPatches);
}

absl::StatusOr<MlsMap> ScanSource::PlaceMap(const ScanRecord& scan) {
  STRATA_ASSIGN_OR_RETURN(const Eigen::Matrix3d R_upright_scan, TurnOf(scan));
  if (R_upright_scan.isIdentity(0.0)) return LocalMap(scan);
  STRATA_RETURN_IF_ERROR(CheckSpread(scan));
  return Build(scan, Pose(R_upright_scan), parameters_.mls, Faded::kWith, kAnyPatches);
}

absl::StatusOr<ScanFeatures> ScanSource::Features(const ScanRecord& scan,
                                                  const MlsMap& map,
                                                  ScanFeatureOptions options) {
  // Where points are dropped all comes from the local map from the first moment.
  if (!scan.has_points || !parameters_.keep_points) return ScanFeatures::FromMap(map, options);
  STRATA_ASSIGN_OR_RETURN(options.up, UpIn(scan));
  STRATA_ASSIGN_OR_RETURN(options.R_map_scan, TurnOf(scan));
  UprightOffsets offsets(map, options.samples_per_metre, options.R_map_scan);
  STRATA_RETURN_IF_ERROR(ForEachBlock(scan, [&offsets](const PointCloud& block) {
    offsets.Add(block.points);
    return absl::OkStatus();
  }));
  return ScanFeatures::FromMap(map, options, &offsets);
}

absl::StatusOr<MlsMap> ScanSource::Contribution(const ScanRecord& scan, const Pose& T_map_scan) {
  if (parameters_.keep_points && scan.has_points) {
    return Build(scan, T_map_scan, parameters_.mls, Faded::kWithout, kAnyPatches);
  }
  STRATA_ASSIGN_OR_RETURN(const MlsMap local_map, LocalMap(scan));
  return TransformContribution(local_map, T_map_scan);
}

}  // namespace strata
