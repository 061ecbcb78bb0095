// One state of a map, read for as long as it takes, while the map goes on changing.
#ifndef STRATA_CORE_ENGINE_MAP_STEADY_VIEW_H_
#define STRATA_CORE_ENGINE_MAP_STEADY_VIEW_H_

#include <optional>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/reader_pool.h"
#include "core/storage/storage.h"

namespace strata {

// The readers see the same scans, poses, points, labels and tiles.
struct SteadyView {
  MapClock clock;
  std::vector<StorageReader*> readers;  // one a thread; never none
};

// Calls `body` with a view for `threads` threads, at least one. The store's journal grows by all
// that is committed meanwhile. CANCELLED, DEADLINE_EXCEEDED by `stop` before `body` began.
absl::Status WithSteadyView(MapCore& core,
                            int threads,
                            const Stop& stop,
                            absl::FunctionRef<absl::Status(const SteadyView&)> body);

// The reader of one of a loop's threads: the view's, or where that is nullptr one on loan, which
// `lease` keeps.
absl::StatusOr<StorageReader*> ReaderOf(MapCore& core,
                                        const SteadyView* view,
                                        int thread,
                                        std::optional<ReaderPool::Lease>& lease);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_STEADY_VIEW_H_
