#include "core/engine/tiles/tile_keeper.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "core/common/guarded.h"
#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "core/engine/map/change_log.h"
#include "core/engine/map/reader_pool.h"
#include "core/engine/tiles/tile_check.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/packed_tile.h"
#include "core/planning/tile_cache.h"
#include "core/planning/tile_source.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

constexpr WorkId kWork{WorkKind::kPrepare, 0};
// Where prepare_after is shorter.
constexpr absl::Duration kShortestLook = absl::Milliseconds(10);
// While another map's tile is prepared.
constexpr absl::Duration kTurnDelay = absl::Milliseconds(200);
// After an error, in times of prepare_after.
constexpr int kRetryLooks = 6;
// While tiles change: so many times what a tile took is left to others.
constexpr int kRestShare = 9;

// The one preparation at rest of this process.
class Turn {
 public:
  Turn() : taken_(!Somebody().exchange(true)) {}
  ~Turn() {
    if (taken_) Somebody() = false;
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  bool taken() const { return taken_; }

 private:
  static std::atomic<bool>& Somebody() {
    static std::atomic<bool> somebody{false};
    return somebody;
  }
  const bool taken_;
};

}  // namespace

// The tiles as they are now.
class TileKeeper::Source final : public TileSource {
 public:
  explicit Source(TileKeeper& keeper) : keeper_(keeper) {}
  ~Source() override { keeper_.decoded_ = std::move(used_); }

  absl::StatusOr<std::shared_ptr<const SurfaceTile>> Load(const TileKey& key) override {
    std::shared_ptr<const SurfaceTile> tile;
    if (const auto it = keeper_.decoded_.find(key); it != keeper_.decoded_.end()) {
      tile = it->second;
    } else {
      STRATA_ASSIGN_OR_RETURN(tile, ReadSurfaceTile(keeper_.core_, key, Version(key)));
    }
    used_[key] = tile;
    return tile;
  }
  std::uint64_t Version(const TileKey& key) override {
    const auto it = keeper_.versions_.find(key);
    return it == keeper_.versions_.end() ? 0 : it->second;
  }

 private:
  TileKeeper& keeper_;
  absl::btree_map<TileKey, std::shared_ptr<const SurfaceTile>> used_;
};

TileKeeper::TileKeeper(MapCore& core, Quarantine& quarantine)
    : core_(core),
      quarantine_(quarantine),
      quiet_(core.options().prepare_after),
      at_rest_(quiet_ == absl::InfiniteDuration()) {}

absl::Duration TileKeeper::Step() {
  const absl::StatusOr<absl::Duration> next = Guarded([this] { return TryStep(); });
  if (next.ok()) return *next;
  Pause();
  at_rest_ = true;
  if (!std::exchange(failed_, true)) {
    Guarded([&] {
      LOG(WARNING)
          << LogLine("prepare").Add("map", core_.name()).Add("stopped", next.status().message());
      return absl::OkStatus();
    }).IgnoreError();
  }
  return kRetryLooks * std::max(quiet_, kShortestLook);
}

absl::StatusOr<absl::Duration> TileKeeper::TryStep() {
  if (quiet_ == absl::InfiniteDuration() || quarantine_.IsHeld(kWork)) {
    at_rest_ = true;
    return absl::InfiniteDuration();
  }
  STRATA_RETURN_IF_ERROR(Look());
  const std::optional<TileKey> due = NextDue();
  if (!due.has_value()) {
    STRATA_RETURN_IF_ERROR(End());
    failed_ = false;
    at_rest_ = stale_.empty();
    return std::max(quiet_, kShortestLook);
  }
  const Turn turn;
  if (!turn.taken()) return kTurnDelay;
  STRATA_RETURN_IF_ERROR(core_.disk().CheckForKeeping(core_.options().max_map_bytes));
  STRATA_ASSIGN_OR_RETURN(const bool begun, Begin());
  if (!begun) return std::max(quiet_, kShortestLook);
  const absl::Time start = SteadyNow();
  STRATA_RETURN_IF_ERROR(Keep(*due));
  stale_.erase(*due);
  failed_ = false;
  const absl::Time end = SteadyNow();
  return end - changed_ < quiet_ ? kRestShare * (end - start) : absl::ZeroDuration();
}

absl::Status TileKeeper::Look() {
  const RobotProfile profile = core_.info().parameters.default_profile;
  const auto [changes, pin] = core_.ChangesSince(seen_);
  const absl::Time now = SteadyNow();
  if (!listed_ || !changes.complete || !(profile == profile_)) {
    if (std::exchange(listed_, false)) changed_ = now;
    profile_ = profile;
    STRATA_RETURN_IF_ERROR(List(pin.view()));
    listed_ = true;
    seen_ = changes.last;
    return absl::OkStatus();
  }
  for (const auto& [key, notice] : changes.tiles) {
    if (notice.gone) {
      versions_.erase(key);
      stale_[key] = now;
    } else {
      versions_[key] = notice.version;
    }
    for (int i = 0; i < 9; ++i) {
      const TileKey around = Neighbour(key, i);
      if (versions_.contains(around)) stale_[around] = now;
    }
  }
  if (!changes.tiles.empty()) {
    changed_ = now;
    decoded_.clear();
  }
  for (const TileKey& key : core_.TakeUnreadable()) stale_[key] = now;
  seen_ = changes.last;
  return absl::OkStatus();
}

absl::Status TileKeeper::List(const MapView& view) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceTileRow> rows,
                          reader->ListSurfaceTiles(TileRange{}, view.tile_version));
  STRATA_ASSIGN_OR_RETURN(const std::vector<PreparedTileRow> kept, reader->ListPreparedTiles());
  versions_ = VersionsOfTiles(rows);
  stale_.clear();
  decoded_.clear();
  for (const TileKey& key : StaleTiles(versions_, kept, profile_)) stale_[key] = changed_;
  return absl::OkStatus();
}

std::optional<TileKey> TileKeeper::NextDue() const {
  const absl::Time until = SteadyNow() - quiet_;
  const auto due = std::find_if(
      stale_.begin(), stale_.end(), [until](const auto& tile) { return tile.second <= until; });
  return due == stale_.end() ? std::nullopt : std::optional<TileKey>(due->first);
}

// The process may have died of it: the next death must say whether it did.
absl::StatusOr<bool> TileKeeper::Begin() {
  if (quarantine_.IsSuspect(kWork)) {
    STRATA_ASSIGN_OR_RETURN(const bool alone, quarantine_.NothingElseUnderWay(kWork));
    if (!alone) {
      Pause();
      return false;
    }
  }
  if (under_way_) return true;
  STRATA_RETURN_IF_ERROR(quarantine_.Begin(kWork));
  under_way_ = true;
  return true;
}

absl::Status TileKeeper::End() {
  decoded_.clear();
  if (!under_way_) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(quarantine_.End(kWork));
  under_way_ = false;
  return absl::OkStatus();
}

void TileKeeper::Pause() {
  at_rest_ = quiet_ == absl::InfiniteDuration();
  decoded_.clear();
  if (!under_way_) return;
  // Where that cannot be written down, it counts if the process is killed now.
  under_way_ = !Guarded([this] { return quarantine_.Pause(kWork); }).ok();
}

absl::Status TileKeeper::Keep(const TileKey& key) {
  const double cell_size_m = core_.info().parameters.mls.cell_size_m;
  const absl::StatusOr<ProfileChecks> checks = MakeProfileChecks(profile_, cell_size_m);
  std::shared_ptr<const PreparedTile> tile;
  if (checks.ok() && versions_.contains(key)) {
    Source source(*this);
    absl::StatusOr<std::shared_ptr<const PreparedTile>> made = PrepareFrom(source, key, *checks);
    // Damage is for plans and verify to name; what mends it changes the tile.
    if (!made.ok() && !absl::IsDataLoss(made.status())) return made.status();
    if (made.ok()) tile = *std::move(made);
  }
  PreparedTileRow row{key, "", ""};
  if (tile != nullptr) {
    row = SealTile(
        key, MadeOf(VersionsAround(versions_, key), profile_), PackTile(*tile, cell_size_m));
  }
  return core_.writer().Run(Durability::kRelaxed, 0, Stop(), [&](StorageWriter& writer) {
    return tile == nullptr ? writer.DeletePreparedTile(key) : writer.PutPreparedTile(row);
  });
}

}  // namespace strata
