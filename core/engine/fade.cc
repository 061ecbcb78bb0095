#include "core/engine/fade.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"

#include "core/common/status.h"
#include "core/engine/job_parameters.h"
#include "core/engine/mls_tiles.h"
#include "core/engine/parallel.h"
#include "core/engine/scan_labels.h"
#include "core/engine/scan_source.h"
#include "core/engine/surface_tiles.h"

namespace strata {
namespace {

// Scans that change in one transaction.
constexpr std::size_t kBatchScans = 64;
// A job by itself has so many new scans to learn from.
constexpr std::uint32_t kFreshScans = 10;

// Of a scan: index of the point, and how many scans looked through its place.
using FadedPoints = std::vector<std::pair<std::uint64_t, std::uint16_t>>;

// A scan with the box of its rays.
struct SeenScan {
  PlacedScanRecord placed;
  Eigen::Vector3d sensor = Eigen::Vector3d::Zero();
  Eigen::AlignedBox2d points, rays;
};

Eigen::AlignedBox2d BoxOf(const absl::btree_set<TileKey>& keys, double cell_size_m) {
  const double edge = kTileCells * cell_size_m;
  Eigen::AlignedBox2d box;
  for (const TileKey& key : keys) {
    box.extend(Eigen::Vector2d(key.x * edge, key.y * edge));
    box.extend(Eigen::Vector2d((key.x + 1) * edge, (key.y + 1) * edge));
  }
  return box;
}

class Fading {
 public:
  Fading(MapCore& core, Worker& worker, const FadeSettings& settings, JobContext& context)
      : core_(core),
        worker_(worker),
        settings_(settings),
        context_(context),
        parameters_(core.info().parameters) {}

  absl::Status Run() {
    STRATA_RETURN_IF_ERROR(ListScans());
    if (!settings_.undo) STRATA_RETURN_IF_ERROR(LookThroughBlocks());
    STRATA_RETURN_IF_ERROR(Apply());
    Report();
    return absl::OkStatus();
  }

 private:
  absl::Status ListScans() {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    const std::uint64_t epoch = core_.snapshots().current().epoch;
    ScanQuery query;
    query.state = ScanState::kIntegrated;
    while (true) {
      STRATA_ASSIGN_OR_RETURN(std::vector<PosedScan> page, reader->ListScans(query, epoch));
      if (page.empty()) break;
      query.after = page.back().scan.number;
      for (PosedScan& posed : page) {
        if (posed.pose.has_value()) AddScan(std::move(posed.scan), posed.pose->T_map_scan);
      }
    }
    std::reverse(scans_.begin(), scans_.end());
    return absl::OkStatus();
  }

  void AddScan(ScanRecord scan, const Pose& T_map_scan) {
    SeenScan seen;
    seen.sensor = T_map_scan * scan.header.sensor_origin.cast<double>();
    seen.points = FootprintOf(scan.box_scan, T_map_scan);
    seen.rays = seen.points;
    seen.rays.extend(Eigen::Vector2d(seen.sensor.head<2>()));
    seen.placed = {std::move(scan), T_map_scan, &as_uploaded_};
    scans_.push_back(std::move(seen));
  }

  // Every tile in which a scan may have points.
  absl::btree_set<TileKey> Keys() const {
    const double edge = kTileCells * parameters_.mls.cell_size_m;
    const auto tile = [edge](double at) {
      return static_cast<std::int32_t>(std::floor(at / edge));
    };
    absl::btree_set<TileKey> keys;
    for (const SeenScan& scan : scans_) {
      if (scan.points.isEmpty()) continue;
      for (std::int32_t y = tile(scan.points.min().y()); y <= tile(scan.points.max().y()); ++y) {
        for (std::int32_t x = tile(scan.points.min().x()); x <= tile(scan.points.max().x()); ++x) {
          keys.insert({0, x, y});
        }
      }
    }
    return keys;
  }

  absl::Status LookThroughBlocks() {
    const std::vector<absl::btree_set<TileKey>> blocks = TileBlocks(Keys());
    std::size_t done = 0;
    return ParallelFor(
        settings_.threads, blocks.size(), [&](int thread, std::size_t i) -> absl::Status {
          STRATA_RETURN_IF_ERROR(LookThroughBlock(blocks[i]));
          absl::MutexLock lock(&mutex_);
          ++done;
          if (thread != 0) return context_.stop().status();
          return context_.Progress(
              0.7 * static_cast<double>(done) / static_cast<double>(blocks.size()),
              "looking along rays");
        });
  }

  absl::Status LookThroughBlock(const absl::btree_set<TileKey>& keys) {
    const Eigen::AlignedBox2d box = BoxOf(keys, parameters_.mls.cell_size_m);
    std::vector<PlacedScanRecord> with_points;
    for (const SeenScan& scan : scans_) {
      if (scan.points.intersects(box)) with_points.push_back(scan.placed);
    }
    STRATA_ASSIGN_OR_RETURN(const MlsTileMap tiles,
                            MakeTiles(core_, with_points, keys, 1, context_.stop()));
    MlsMap map;
    map.parameters = parameters_.mls;
    for (const auto& [key, tile] : tiles) {
      if (tile != nullptr) map.tiles.push_back(*tile);
    }
    SeeThrough see_through(map, settings_.evidence);
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    for (const SeenScan& scan : scans_) {
      STRATA_RETURN_IF_ERROR(context_.stop().status());
      if (scan.rays.intersects(box)) {
        STRATA_RETURN_IF_ERROR(
            Annotate(TakeScan(scan, *reader, see_through),
                     absl::StrCat("scan ", scan.placed.scan.header.id.ToString())));
      }
    }
    return absl::OkStatus();
  }

  absl::Status TakeScan(const SeenScan& scan, StorageReader& reader, SeeThrough& see_through) {
    ScanSource source(reader, parameters_);
    const SensorModel sensor = scan.placed.scan.header.sensor.value_or(parameters_.sensor);
    FadedPoints faded;
    std::uint64_t first = 0;
    see_through.BeginScan(scan.sensor);
    const auto returns = [&](const PointCloud& block, std::vector<std::uint64_t>* indices) {
      std::vector<Eigen::Vector3d> points;
      for (std::size_t i = 0; i < block.size(); ++i) {
        const float range = (block.points[i] - block.sensor_origin).norm();
        if (!(range >= sensor.min_range_m && range <= sensor.max_range_m)) continue;
        points.emplace_back(scan.placed.T_map_scan * block.points[i].cast<double>());
        if (indices != nullptr) indices->push_back(first + i);
      }
      return points;
    };
    STRATA_RETURN_IF_ERROR(source.ForEachBlock(scan.placed.scan, [&](const PointCloud& block) {
      std::vector<std::uint64_t> indices;
      const std::vector<std::uint16_t> gone = see_through.TakePoints(returns(block, &indices));
      for (std::size_t i = 0; i < gone.size(); ++i) {
        if (gone[i] != 0) faded.emplace_back(indices[i], gone[i]);
      }
      first += block.size();
      return absl::OkStatus();
    }));
    STRATA_RETURN_IF_ERROR(source.ForEachBlock(scan.placed.scan, [&](const PointCloud& block) {
      see_through.LookAlong(returns(block, nullptr));
      return absl::OkStatus();
    }));
    see_through.EndScan();
    absl::MutexLock lock(&mutex_);
    FadedPoints& all = faded_[scan.placed.scan.number];
    all.insert(all.end(), faded.begin(), faded.end());
    return absl::OkStatus();
  }

  LabelChange ChangeOf(const ScanRecord& scan) {
    LabelChange change{LabelOrigin::kFaded, 0, std::vector<std::uint16_t>(scan.header.point_count)};
    absl::MutexLock lock(&mutex_);
    for (const auto& [index, scans] : faded_[scan.number]) change.labels[index] = scans;
    change.model = faded_[scan.number].size();
    return change;
  }

  // Records what is not as it was.
  absl::Status Apply() {
    std::map<ScanNumber, LabelChange> batch;
    for (std::size_t i = 0; i < scans_.size(); ++i) {
      STRATA_RETURN_IF_ERROR(
          context_.Progress(0.7 + 0.3 * static_cast<double>(i) / static_cast<double>(scans_.size()),
                            "making tiles without what has gone"));
      const ScanRecord& scan = scans_[i].placed.scan;
      LabelChange change = ChangeOf(scan);
      points_ += change.model;
      STRATA_ASSIGN_OR_RETURN(const bool same, IsStored(scan, change));
      if (!same) batch.emplace(scan.number, std::move(change));
      if (batch.size() < kBatchScans && i + 1 < scans_.size()) continue;
      changed_ += batch.size();
      STRATA_RETURN_IF_ERROR(worker_.Execute(
          context_.stop(), [&](Integrator& integrator) { return integrator.SetFaded(batch); }));
      batch.clear();
    }
    return absl::OkStatus();
  }

  absl::StatusOr<bool> IsStored(const ScanRecord& scan, const LabelChange& change) {
    if (scan.faded_points == 0 || change.model == 0) return scan.faded_points == change.model;
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> stored,
                            ReadLabels(*reader, scan, LabelOrigin::kFaded));
    return stored == change.labels;
  }

  void Report() {
    context_.SetMetric("scans", static_cast<double>(scans_.size()));
    context_.SetMetric("scans_changed", static_cast<double>(changed_));
    context_.SetMetric("points_faded", static_cast<double>(points_));
    // Where the next one need not begin before there is more.
    const ScanNumber newest = scans_.empty() ? 0 : scans_.front().placed.scan.number;
    context_.SetMetric("newest_scan", static_cast<double>(newest));
    context_.SetMessage(absl::StrCat(
        points_, " points of ", scans_.size(), " scans have faded; ", changed_, " scans changed"));
  }

  MapCore& core_;
  Worker& worker_;
  const FadeSettings settings_;
  JobContext& context_;
  const MapParameters parameters_;
  // Evidence comes from the scans alone, whatever was decided before.
  const LabelChange as_uploaded_{LabelOrigin::kFaded, 0, {}};
  std::vector<SeenScan> scans_;  // newest first
  std::uint64_t points_ = 0;
  std::uint64_t changed_ = 0;
  absl::Mutex mutex_;
  std::map<ScanNumber, FadedPoints> faded_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace

absl::StatusOr<FadeSettings> ParseFadeSettings(const JobParameters& parameters) {
  FadeSettings settings;
  SeeThroughOptions& evidence = settings.evidence;
  STRATA_RETURN_IF_ERROR(ReadJobParameters(
      kFadeJob,
      parameters,
      {{"scans", {WholeParameter(evidence.scans, 1, kMaxFadeAfter), "in [1, 1000]"}},
       {"rays", {WholeParameter(evidence.rays, 1, 100'000), "in [1, 100000]"}},
       {"clearance_m", {RealParameter(evidence.clearance_m, 0.05, 10.0), "in [0.05, 10]"}},
       {"undo", {FlagParameter(settings.undo), "0 or 1"}},
       {"threads", {WholeParameter(settings.threads, 1, 64), "in [1, 64]"}}}));
  settings.scans_given = parameters.contains("scans");
  return settings;
}

absl::StatusOr<bool> FadingIsDue(MapCore& core, const std::vector<JobInfo>& jobs) {
  if (core.info().parameters.fade_after == 0) return false;
  ScanQuery fresh;
  fresh.state = ScanState::kIntegrated;
  fresh.limit = kFreshScans;
  for (const JobInfo& job : jobs) {
    if (job.kind != kFadeJob) continue;
    if (!IsFinal(job.state)) return false;
    const auto newest = job.metrics.find("newest_scan");
    if (newest == job.metrics.end()) continue;
    fresh.after = std::max(fresh.after, static_cast<ScanNumber>(newest->second));
  }
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  STRATA_ASSIGN_OR_RETURN(const std::vector<PosedScan> scans,
                          reader->ListScans(fresh, core.snapshots().current().epoch));
  return scans.size() == kFreshScans;
}

absl::Status RunFadeJob(MapCore& core, Worker& worker, const JobInfo& job, JobContext& context) {
  STRATA_ASSIGN_OR_RETURN(FadeSettings settings, ParseFadeSettings(job.parameters));
  const std::uint32_t fade_after = core.info().parameters.fade_after;
  if (!settings.scans_given && fade_after > 0) {
    settings.evidence.scans = static_cast<int>(fade_after);
  }
  return Fading(core, worker, settings, context).Run();
}

}  // namespace strata
