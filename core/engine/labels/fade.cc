#include "core/engine/labels/fade.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"

#include "core/common/status.h"
#include "core/engine/map/parallel.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/scan_labels.h"
#include "core/engine/scans/scan_source.h"
#include "core/engine/tiles/mls_tiles.h"
#include "core/engine/tiles/surface_tiles.h"
#include "core/mls/see_through.h"
#include "core/world/job_kinds.h"

namespace strata {
namespace {

// A job by itself has so many new scans to learn from.
constexpr std::uint32_t kFreshScans = 10;
constexpr std::size_t kRaysBetweenStops = 10'000;

// Faded points of a scan: index, and how many scans looked through the place.
using FadedPoints = std::vector<std::pair<std::uint64_t, std::uint16_t>>;

struct FadeSettings {
  SeeThroughOptions evidence;
  bool undo = false;  // everything comes back
  int threads = 2;
};

FadeSettings SettingsOf(const JobArguments& arguments, const MapCore& core) {
  FadeSettings settings;
  SeeThroughOptions& evidence = settings.evidence;
  const std::uint32_t fade_after = core.info().parameters.fade_after;
  if (fade_after > 0) evidence.scans = static_cast<int>(fade_after);
  if (arguments.Has("scans")) evidence.scans = static_cast<int>(arguments.Whole("scans"));
  evidence.rays = static_cast<int>(arguments.Whole("rays"));
  evidence.clearance_m = arguments.Real("clearance_m");
  settings.undo = arguments.Flag("undo");
  settings.threads = ThreadsOf(arguments, core.options());
  return settings;
}

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
    STRATA_RETURN_IF_ERROR(ForEachPosedScan(*reader, query, epoch, [&](PosedScan posed) {
      AddScan(std::move(posed.scan), posed.pose->T_map_scan);
    }));
    std::reverse(scans_.begin(), scans_.end());
    return absl::OkStatus();
  }

  void AddScan(ScanRecord scan, const Pose& T_map_scan) {
    SeenScan seen;
    seen.sensor = T_map_scan * scan.header.sensor_origin.cast<double>();
    seen.placed = {std::move(scan), T_map_scan, &as_uploaded_};
    scans_.push_back(std::move(seen));
  }

  // Finds the tiles in which scans have points. Not by the boxes of scans, which also hold the
  // points that the map ignores, wherever those are.
  absl::StatusOr<absl::btree_set<TileKey>> FindKeys() {
    absl::btree_set<TileKey> keys;
    STRATA_RETURN_IF_ERROR(
        ParallelFor(settings_.threads, scans_.size(), [&](int thread, std::size_t i) {
          return Skipping(scans_[i], [&]() -> absl::Status {
            if (thread == 0) STRATA_RETURN_IF_ERROR(context_.Progress(0.0, "finding tiles"));
            STRATA_ASSIGN_OR_RETURN(const absl::btree_set<TileKey> own, KeysOf(scans_[i]));
            absl::MutexLock lock(&mutex_);
            keys.insert(own.begin(), own.end());
            return absl::OkStatus();
          });
        }));
    return keys;
  }

  absl::StatusOr<absl::btree_set<TileKey>> KeysOf(SeenScan& scan) {
    const double edge = kTileCells * parameters_.mls.cell_size_m;
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    ScanSource source(*reader, parameters_);
    absl::btree_set<TileKey> keys;
    TileKey last{-1, 0, 0};  // of level -1, as no tile is
    const auto take = [&](const PointCloud& block) -> absl::Status {
      STRATA_RETURN_IF_ERROR(context_.stop().status());
      for (const Eigen::Vector3d& point : ReturnsOf(scan, block, nullptr)) {
        scan.points.extend(Eigen::Vector2d(point.head<2>()));
        const TileKey key{0,
                          static_cast<std::int32_t>(std::floor(point.x() / edge)),
                          static_cast<std::int32_t>(std::floor(point.y() / edge))};
        if (key != last) keys.insert(key);
        last = key;
      }
      return absl::OkStatus();
    };
    STRATA_RETURN_IF_ERROR(source.ForEachBlock(scan.placed.scan, take));
    scan.rays = scan.points;
    if (!scan.points.isEmpty()) scan.rays.extend(Eigen::Vector2d(scan.sensor.head<2>()));
    return keys;
  }

  // The points of a block that the map takes, map frame [m]; `indices` gets which those are.
  std::vector<Eigen::Vector3d> ReturnsOf(const SeenScan& scan,
                                         const PointCloud& block,
                                         std::vector<std::size_t>* indices) const {
    const SensorModel sensor = scan.placed.scan.header.sensor.value_or(parameters_.sensor);
    const double most_m = kMaxCellIndex * parameters_.mls.cell_size_m;
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < block.size(); ++i) {
      const float range = (block.points[i] - block.sensor_origin).norm();
      if (!sensor.Takes(range)) continue;
      const Eigen::Vector3d point = scan.placed.T_map_scan * block.points[i].cast<double>();
      if (!(point.head<2>().cwiseAbs().maxCoeff() < most_m)) continue;
      points.push_back(point);
      if (indices != nullptr) indices->push_back(i);
    }
    return points;
  }

  // Runs `body`, which reads the scan; what it fails for is no fault if the scan has been deleted
  // meanwhile.
  absl::Status Skipping(const SeenScan& scan, absl::FunctionRef<absl::Status()> body) {
    const absl::Status done = body();
    if (!absl::IsDataLoss(done)) return done;
    STRATA_ASSIGN_OR_RETURN(const bool there, StillThere(scan.placed.scan.number));
    if (!there) return absl::OkStatus();
    return Annotate(done, absl::StrCat("scan ", scan.placed.scan.header.id.ToString()));
  }

  absl::StatusOr<bool> StillThere(ScanNumber number) {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    return IsThere(*reader, number, core_.snapshots().current().epoch);
  }

  absl::Status LookThroughBlocks() {
    STRATA_ASSIGN_OR_RETURN(const absl::btree_set<TileKey> keys, FindKeys());
    const std::vector<absl::btree_set<TileKey>> blocks = TileBlocks(keys);
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
    STRATA_ASSIGN_OR_RETURN(const MlsTileMap tiles, TilesOf(keys, box));
    MlsMap map;
    map.parameters = parameters_.mls;
    for (const auto& [key, tile] : tiles) {
      if (tile != nullptr) map.tiles.push_back(*tile);
    }
    SeeThrough see_through(map, settings_.evidence);
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    for (const SeenScan& scan : scans_) {
      STRATA_RETURN_IF_ERROR(context_.stop().status());
      if (!scan.rays.intersects(box)) continue;
      STRATA_RETURN_IF_ERROR(Skipping(scan, [&] { return TakeScan(scan, *reader, see_through); }));
    }
    return absl::OkStatus();
  }

  // What all scans made of the tiles together. Again, where one was deleted in the middle of it.
  absl::StatusOr<MlsTileMap> TilesOf(const absl::btree_set<TileKey>& keys,
                                     const Eigen::AlignedBox2d& box) {
    std::vector<PlacedScanRecord> with_points;
    for (const SeenScan& scan : scans_) {
      if (scan.points.intersects(box)) with_points.push_back(scan.placed);
    }
    while (true) {
      absl::StatusOr<MlsTileMap> tiles = MakeTiles(core_, with_points, keys, 1, context_.stop());
      if (!absl::IsDataLoss(tiles.status())) return tiles;
      std::vector<PlacedScanRecord> there;
      for (const PlacedScanRecord& placed : with_points) {
        STRATA_ASSIGN_OR_RETURN(const bool is_there, StillThere(placed.scan.number));
        if (is_there) there.push_back(placed);
      }
      if (there.size() == with_points.size()) return tiles;
      with_points = std::move(there);
    }
  }

  absl::Status TakeScan(const SeenScan& scan, StorageReader& reader, SeeThrough& see_through) {
    ScanSource source(reader, parameters_);
    FadedPoints faded;
    std::uint64_t first = 0;
    see_through.BeginScan(scan.sensor);
    STRATA_RETURN_IF_ERROR(source.ForEachBlock(scan.placed.scan, [&](const PointCloud& block) {
      std::vector<std::size_t> indices;
      const std::vector<std::uint16_t> gone =
          see_through.TakePoints(ReturnsOf(scan, block, &indices));
      for (std::size_t i = 0; i < gone.size(); ++i) {
        if (gone[i] != 0) faded.emplace_back(first + indices[i], gone[i]);
      }
      first += block.size();
      return context_.stop().status();
    }));
    STRATA_RETURN_IF_ERROR(source.ForEachBlock(scan.placed.scan, [&](const PointCloud& block) {
      return LookAlong(ReturnsOf(scan, block, nullptr), see_through);
    }));
    see_through.EndScan();
    absl::MutexLock lock(&mutex_);
    FadedPoints& all = faded_[scan.placed.scan.number];
    all.insert(all.end(), faded.begin(), faded.end());
    return absl::OkStatus();
  }

  absl::Status LookAlong(std::span<const Eigen::Vector3d> points, SeeThrough& see_through) const {
    while (!points.empty()) {
      STRATA_RETURN_IF_ERROR(context_.stop().status());
      const std::size_t count = std::min(points.size(), kRaysBetweenStops);
      see_through.LookAlong(points.first(count));
      points = points.subspan(count);
    }
    return absl::OkStatus();
  }

  LabelChange ChangeOf(const ScanRecord& scan) {
    LabelChange change{LabelOrigin::kFaded, 0, std::vector<std::uint16_t>(scan.header.point_count)};
    absl::MutexLock lock(&mutex_);
    const auto faded = faded_.find(scan.number);
    if (faded == faded_.end()) return change;
    for (const auto& [index, scans] : faded->second) change.labels[index] = scans;
    change.model = faded->second.size();
    return change;
  }

  // Records what is not as it was, at once.
  absl::Status Apply() {
    const auto change_of = [this](const ScanRecord& scan) { return ChangeOf(scan); };
    FadingRequest request{{}, change_of};
    for (const SeenScan& scan : scans_) request.scans.push_back(scan.placed.scan.number);
    return worker_.Execute(context_.stop(), [&](Integrator& integrator) -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(changed_, integrator.SetFaded(request, context_));
      return absl::OkStatus();
    });
  }

  void Report() {
    std::uint64_t points = 0;
    {
      absl::MutexLock lock(&mutex_);
      for (const auto& [number, faded] : faded_) points += faded.size();
    }
    context_.SetMetric("scans", static_cast<double>(scans_.size()));
    context_.SetMetric("scans_changed", static_cast<double>(changed_));
    context_.SetMetric("points_faded", static_cast<double>(points));
    // Where the next one need not begin before there is more.
    const ScanNumber newest = scans_.empty() ? 0 : scans_.front().placed.scan.number;
    context_.SetMetric("newest_scan", static_cast<double>(newest));
    context_.SetMessage(absl::StrCat(
        points, " points of ", scans_.size(), " scans have faded; ", changed_, " scans changed"));
  }

  MapCore& core_;
  Worker& worker_;
  const FadeSettings settings_;
  JobContext& context_;
  const MapParameters parameters_;
  // Evidence comes from the scans alone, whatever was decided before.
  const LabelChange as_uploaded_{LabelOrigin::kFaded, 0, {}};
  std::vector<SeenScan> scans_;  // newest first
  std::size_t changed_ = 0;
  absl::Mutex mutex_;
  std::map<ScanNumber, FadedPoints> faded_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace

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

absl::Status RunFadeJob(MapCore& core,
                        Worker& worker,
                        const JobArguments& arguments,
                        JobContext& context) {
  return Fading(core, worker, SettingsOf(arguments, core), context).Run();
}

}  // namespace strata
