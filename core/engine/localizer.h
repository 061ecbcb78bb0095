// Where was this scan taken? Answers of one map (thesis 6.2.1).
#ifndef STRATA_CORE_ENGINE_LOCALIZER_H_
#define STRATA_CORE_ENGINE_LOCALIZER_H_

#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "core/common/stop.h"
#include "core/engine/map_core.h"
#include "core/world/localization.h"

namespace strata {

// Thread-safe; answers one question at a time.
class Localizer {
 public:
  explicit Localizer(MapCore& core) : core_(core) {}

  // INVALID_ARGUMENT naming the field.
  absl::StatusOr<LocalizeResult> Localize(const LocalizeQuery& query, const Stop& stop);

 private:
  MapCore& core_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_LOCALIZER_H_
