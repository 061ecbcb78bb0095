// Where was this scan taken? Answers of one map (thesis 6.2.1).
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_LOCALIZER_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_LOCALIZER_H_

#include <memory>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "core/common/stop.h"
#include "core/engine/scans/scan_access.h"
#include "core/registration/place_descriptor.h"
#include "core/world/localization.h"

namespace strata {

// Thread-safe. What places look like is kept between questions, until the map changes.
class Localizer {
 public:
  explicit Localizer(ScanAccess access) : access_(std::move(access)) {}
  ~Localizer();

  // INVALID_ARGUMENT naming the field that is wrong. Scans of the map that are damaged are no
  // places.
  absl::StatusOr<LocalizeResult> Localize(const LocalizeQuery& query, const Stop& stop);

 private:
  struct Places;
  class Search;

  // The places of the present state.
  absl::StatusOr<std::shared_ptr<Places>> CurrentPlaces(const Stop& stop);
  // `before`: an earlier state, or nullptr.
  absl::StatusOr<std::vector<PlaceDescriptor>> Describe(Places& places,
                                                        const Places* before,
                                                        const Stop& stop) const;

  const ScanAccess access_;
  absl::Mutex mutex_;
  std::shared_ptr<Places> places_ ABSL_GUARDED_BY(mutex_);  // nullptr: never asked for
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_LOCALIZER_H_
