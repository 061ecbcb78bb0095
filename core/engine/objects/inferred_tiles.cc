#include "core/engine/objects/inferred_tiles.h"

#include <cstddef>
#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/objects/completion.h"
#include "core/world/things/inferred.h"

namespace strata {
namespace {

// Deleting scans of a kind one by one changes it as often.
constexpr int kMostReadings = 5;

std::size_t BytesOf(const InferredState& state) {
  std::size_t bytes = sizeof(state);
  for (const auto& [key, tile] : state.tiles) bytes += sizeof(key) + tile->memory_bytes();
  return bytes;
}

}  // namespace

absl::StatusOr<std::shared_ptr<const InferredState>> InferredTiles::Load(const MapState& state,
                                                                         const Stop& stop) const {
  auto loaded = std::make_shared<InferredState>();
  loaded->changed = state.changes().inferred;
  InferredTileMaker maker(cell_size_m_);
  const absl::StatusOr<InferredInfo> info =
      ReadInferred(state, {}, stop, [&maker](const InferredPart& part) {
        maker.Add(part.points);
        return absl::OkStatus();
      });
  if (absl::IsNotFound(info.status())) return loaded;
  STRATA_RETURN_IF_ERROR(info.status());
  loaded->epoch = info->epoch;
  loaded->tiles = maker.Finish();
  return loaded;
}

absl::StatusOr<std::shared_ptr<const InferredState>> InferredTiles::Now(const MapState& state,
                                                                        const Stop& stop) {
  const std::shared_ptr<const InferredState> held = state.open_here() ? kept_.Find(kOnly) : nullptr;
  if (held != nullptr && held->changed >= state.changes().inferred) return held;
  for (int reading = 1;; ++reading) {
    absl::StatusOr<std::shared_ptr<const InferredState>> loaded = Load(state, stop);
    if (absl::IsAborted(loaded.status()) && reading < kMostReadings) continue;
    STRATA_RETURN_IF_ERROR(loaded.status());
    if (state.open_here()) kept_.Put(kOnly, *loaded, BytesOf(**loaded));
    return loaded;
  }
}

}  // namespace strata
