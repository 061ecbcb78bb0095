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

absl::StatusOr<std::shared_ptr<const InferredState>> InferredTiles::Load(const Stop& stop) const {
  auto state = std::make_shared<InferredState>();
  state->changed = core_.changes().inferred();
  InferredTileMaker maker(core_.info().parameters.mls.cell_size_m);
  const absl::StatusOr<InferredInfo> info =
      ReadInferred(core_, {}, stop, [&maker](const InferredPart& part) {
        maker.Add(part.points);
        return absl::OkStatus();
      });
  if (absl::IsNotFound(info.status())) return state;
  STRATA_RETURN_IF_ERROR(info.status());
  state->epoch = info->epoch;
  state->tiles = maker.Finish();
  return state;
}

absl::StatusOr<std::shared_ptr<const InferredState>> InferredTiles::Now(const Stop& stop) {
  const std::shared_ptr<const InferredState> held = state_.Find(kOnly);
  if (held != nullptr && held->changed == core_.changes().inferred()) return held;
  for (int reading = 1;; ++reading) {
    absl::StatusOr<std::shared_ptr<const InferredState>> state = Load(stop);
    if (absl::IsAborted(state.status()) && reading < kMostReadings) continue;
    STRATA_RETURN_IF_ERROR(state.status());
    state_.Put(kOnly, *state, BytesOf(**state));
    return state;
  }
}

}  // namespace strata
