#include "core/engine/models/square_points.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/scans/scan_source.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

// Of a scan that is kept: the first block of ScanSource::ForEachBlock() is all of it.
constexpr std::uint64_t kMostHeldPoints = 999'999;
constexpr std::size_t kHeldBytes = 128;  // beside its points

std::int64_t SquareIndexOf(double at_m) {
  return static_cast<std::int64_t>(std::floor(at_m / kSquareM));
}

template <typename T>
void KeepHalfOf(std::vector<T>& column) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < column.size(); i += 2) column[kept++] = column[i];
  column.resize(kept);
}

// Keeps every second point, so that which are kept depends on their order alone.
void KeepHalf(PosedPoints& points) {
  KeepHalfOf(points.points);
  KeepHalfOf(points.colour);
  for (PosedPoints::View& view : points.views) view.end = (view.end + 1) / 2;
}

}  // namespace

absl::Status SquarePoints::ListScans(std::uint64_t epoch, const Stop& stop) {
  epoch_ = epoch;
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  ScanQuery query;
  query.state = ScanState::kIntegrated;
  query.skip_damaged = true;  // verify names it
  STRATA_RETURN_IF_ERROR(ForEachPosedScan(*reader, query, epoch, [&](PosedScan posed) {
    if (!posed.scan.has_points) {
      ++without_points_;
      return;
    }
    if (choice_.colour && !posed.scan.header.has_colour) {
      ++without_colour_;
      return;
    }
    scans_.push_back({std::move(posed.scan), posed.pose->T_map_scan});
  }));
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_ASSIGN_OR_RETURN(const std::vector<TileKey> tiles,
                            reader->TilesOfScan(scans_[i].scan.number));
    if (!AddTiles(tiles, i) && choice_.region.has_value()) continue;
    ++reaching_;
    points_ += scans_[i].scan.header.point_count;
  }
  for (const Place& place : places_) {
    const Eigen::Vector2d corner(kSquareM * static_cast<double>(place.first),
                                 kSquareM * static_cast<double>(place.second));
    squares_.emplace_back(corner, corner + Eigen::Vector2d(kSquareM, kSquareM));
  }
  return absl::OkStatus();
}

bool SquarePoints::AddTiles(const std::vector<TileKey>& tiles, std::size_t scan) {
  const double edge_m = kTileCells * core_.info().parameters.mls.cell_size_m;
  const auto in_region = [this](std::int64_t x, std::int64_t y) {
    if (!choice_.region.has_value()) return true;
    const Eigen::Vector2d corner(kSquareM * static_cast<double>(x),
                                 kSquareM * static_cast<double>(y));
    const PlanSquare square(corner, corner + Eigen::Vector2d(kSquareM, kSquareM));
    return square.intersects(
        PlanSquare(choice_.region->min().head<2>(), choice_.region->max().head<2>()));
  };
  absl::btree_set<Place> around;
  for (const TileKey& tile : tiles) {
    const auto range = [edge_m](std::int32_t at, double margin_m) {
      return std::pair(SquareIndexOf(at * edge_m - margin_m),
                       SquareIndexOf((at + 1) * edge_m + margin_m - 1e-6));
    };
    const auto [x_first, x_last] = range(tile.x, kSquareMarginM);
    const auto [y_first, y_last] = range(tile.y, kSquareMarginM);
    for (std::int64_t x = x_first; x <= x_last; ++x) {
      for (std::int64_t y = y_first; y <= y_last; ++y) {
        if (in_region(x, y)) around.insert({x, y});
      }
    }
  }
  for (const Place& place : around) {
    std::vector<std::size_t>& scans = scans_around_[place];
    if (scans.empty())
      places_.insert(std::upper_bound(places_.begin(), places_.end(), place), place);
    scans.push_back(scan);
  }
  return !around.empty();
}

absl::StatusOr<PosedPoints> SquarePoints::Load(std::size_t i, const Stop& stop) {
  const PlanSquare& square = squares_[i];
  const Eigen::Vector2d margin(kSquareMarginM, kSquareMarginM);
  const PlanSquare around(square.min() - margin, square.max() + margin);
  Thinned thinned;
  PosedPoints& points = thinned.points;
  points.origin << square.center(), 0.0;
  for (const std::size_t scan : scans_around_.at(places_[i])) {
    const PlacedScan& placed = scans_[scan];
    const absl::Status done = ForEachPart(
        scan, stop, [&](const ScanPoints& part) { Append(placed, part, around, thinned); });
    if (done.ok()) {
      const Eigen::Vector3d sensor =
          placed.T_map_scan * placed.scan.header.sensor_origin.cast<double>() - points.origin;
      points.views.push_back({sensor.cast<float>(), points.points.size()});
      continue;
    }
    const std::size_t before = points.views.empty() ? 0 : points.views.back().end;
    points.points.resize(before);
    if (choice_.colour) points.colour.resize(before);
    STRATA_ASSIGN_OR_RETURN(const bool leave_out, MayLeaveOut(placed, done));
    if (!leave_out) return done;
  }
  if (thinned.every > 1) thinned_.insert(i);
  most_thinned_ = std::max(most_thinned_, thinned.every);
  loaded_ += points.points.size();
  return std::move(thinned.points);
}

absl::Status SquarePoints::ForEachLabelled(
    std::size_t i,
    double margin_m,
    const Stop& stop,
    absl::FunctionRef<absl::Status(ScanNumber, std::span<const LabelledPoint>)> use) {
  const Eigen::Vector2d margin(margin_m, margin_m);
  const PlanSquare around(squares_[i].min() - margin, squares_[i].max() + margin);
  for (const std::size_t scan : scans_around_.at(places_[i])) {
    const PlacedScan& placed = scans_[scan];
    const Eigen::Vector3d at = placed.T_map_scan.translation();
    std::vector<LabelledPoint> points;
    const absl::Status done = ForEachPart(scan, stop, [&](const ScanPoints& part) {
      for (std::size_t k = 0; k < part.points.size(); ++k) {
        const Eigen::Vector3d p = at + part.points[k].cast<double>();
        if (!around.contains(p.head<2>())) continue;
        if (choice_.region.has_value() && !choice_.region->contains(p)) continue;
        points.push_back({p, part.label[k]});
      }
    });
    if (!done.ok()) {
      STRATA_ASSIGN_OR_RETURN(const bool leave_out, MayLeaveOut(placed, done));
      if (!leave_out) return done;
      continue;
    }
    loaded_ += points.size();
    STRATA_RETURN_IF_ERROR(use(placed.scan.number, points));
  }
  return absl::OkStatus();
}

absl::StatusOr<bool> SquarePoints::MayLeaveOut(const PlacedScan& placed, const absl::Status& why) {
  if (absl::IsFailedPrecondition(why)) return true;  // its points were dropped meanwhile
  if (!absl::IsDataLoss(why) && !absl::IsNotFound(why)) return false;
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const bool there, IsThere(*reader, placed.scan.number, epoch_));
  return !there || damaged_.LeaveOut(placed.scan.number, placed.scan.header.id.ToString(), why);
}

absl::Status SquarePoints::ForEachPart(std::size_t scan,
                                       const Stop& stop,
                                       absl::FunctionRef<void(const ScanPoints&)> body) {
  if (const auto held = held_.Find(scan); held != nullptr) {
    body(*held);
    return absl::OkStatus();
  }
  const bool hold = scans_[scan].scan.header.point_count <= kMostHeldPoints;
  return Decode(scans_[scan], stop, [&](ScanPoints part) {
    body(part);
    if (!hold) return;  // otherwise the part is all of it
    part.points.shrink_to_fit();
    part.colour.shrink_to_fit();
    part.label.shrink_to_fit();
    const std::size_t bytes = part.points.size() * sizeof(part.points[0]) +
                              part.colour.size() * sizeof(part.colour[0]) +
                              part.label.size() * sizeof(part.label[0]) + kHeldBytes;
    held_.Put(scan, std::make_shared<const ScanPoints>(std::move(part)), bytes);
  });
}

absl::Status SquarePoints::Decode(const PlacedScan& placed,
                                  const Stop& stop,
                                  absl::FunctionRef<void(ScanPoints)> body) {
  const MapParameters parameters = core_.info().parameters;
  const SensorModel sensor = placed.scan.header.sensor.value_or(parameters.sensor);
  const Eigen::Matrix3d turn = placed.T_map_scan.linear();
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  const ScanShare share(core_.caches(), placed.scan);
  ScanSource source(*reader, parameters);
  return source.ForEachBlock(placed.scan, [&](const PointCloud& block) -> absl::Status {
    STRATA_RETURN_IF_ERROR(stop.status());
    ScanPoints part;
    part.points.reserve(block.size());
    for (std::size_t i = 0; i < block.size(); ++i) {
      if (!source.faded().empty() && source.faded()[i] != 0) continue;
      if (!sensor.Takes((block.points[i] - block.sensor_origin).norm())) continue;
      if (choice_.labels && (block.label.empty() || block.label[i] == 0)) continue;
      part.points.push_back((turn * block.points[i].cast<double>()).cast<float>());
      if (choice_.colour) part.colour.push_back(block.colour[i]);
      if (choice_.labels) part.label.push_back(block.label[i]);
    }
    body(std::move(part));
    return absl::OkStatus();
  });
}

void SquarePoints::Append(const PlacedScan& placed,
                          const ScanPoints& part,
                          const PlanSquare& around,
                          Thinned& thinned) const {
  PosedPoints& points = thinned.points;
  const Eigen::Vector3d at = placed.T_map_scan.translation();
  for (std::size_t i = 0; i < part.points.size(); ++i) {
    const Eigen::Vector3d p = at + part.points[i].cast<double>();
    if (!around.contains(p.head<2>())) continue;
    if (choice_.region.has_value() && !choice_.region->contains(p)) continue;
    if (thinned.inside++ % thinned.every != 0) continue;
    if (points.points.empty()) points.origin.z() = p.z();
    const Eigen::Vector3f from_origin = (p - points.origin).cast<float>();
    if (std::abs(from_origin.z()) >= kMostFromOriginM) continue;
    points.points.push_back(from_origin);
    if (choice_.colour) points.colour.push_back(part.colour[i]);
  }
  while (points.points.size() > most_points_) {
    KeepHalf(points);
    thinned.every *= 2;
  }
}

}  // namespace strata
