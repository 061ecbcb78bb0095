#include "core/engine/map/steady_view.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "absl/status/statusor.h"

#include "core/common/status.h"

namespace strata {
namespace {

// All that scans and tiles follow from changes one of these numbers.
bool SameState(const MapClock& a, const MapClock& b) {
  return a.commit_sequence == b.commit_sequence && a.epoch == b.epoch &&
         a.tile_version == b.tile_version && a.derived_complete == b.derived_complete;
}

// Opens the view reader by reader; false: a commit came between two of them.
class Opening {
 public:
  Opening(std::vector<ReaderPool::Lease> leases,
          absl::FunctionRef<absl::Status(const SteadyView&)> body)
      : leases_(std::move(leases)), body_(body) {}

  absl::StatusOr<bool> Run() {
    bool opened = false;
    STRATA_RETURN_IF_ERROR(leases_[view_.readers.size()]->Snapshot([&]() -> absl::Status {
      StorageReader& reader = *leases_[view_.readers.size()];
      // The first read is what fixes the state.
      STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader.GetClock());
      if (view_.readers.empty()) view_.clock = clock;
      if (!SameState(clock, view_.clock)) return absl::OkStatus();
      view_.readers.push_back(&reader);
      if (view_.readers.size() < leases_.size()) {
        STRATA_ASSIGN_OR_RETURN(opened, Run());
        return absl::OkStatus();
      }
      opened = true;
      return body_(view_);
    }));
    return opened;
  }

 private:
  std::vector<ReaderPool::Lease> leases_;
  const absl::FunctionRef<absl::Status(const SteadyView&)> body_;
  SteadyView view_;
};

}  // namespace

absl::Status WithSteadyView(MapCore& core,
                            int threads,
                            const Stop& stop,
                            absl::FunctionRef<absl::Status(const SteadyView&)> body) {
  while (true) {
    STRATA_RETURN_IF_ERROR(stop.status());
    std::vector<ReaderPool::Lease> leases;
    for (int i = 0; i < std::max(threads, 1); ++i) {
      STRATA_ASSIGN_OR_RETURN(ReaderPool::Lease lease, core.Reader());
      leases.push_back(std::move(lease));
    }
    STRATA_ASSIGN_OR_RETURN(const bool opened, Opening(std::move(leases), body).Run());
    if (opened) return absl::OkStatus();
  }
}

absl::StatusOr<StorageReader*> ReaderOf(MapCore& core,
                                        const SteadyView* view,
                                        int thread,
                                        std::optional<ReaderPool::Lease>& lease) {
  if (view != nullptr) return view->readers[static_cast<std::size_t>(thread)];
  STRATA_ASSIGN_OR_RETURN(ReaderPool::Lease taken, core.Reader());
  lease.emplace(std::move(taken));
  return &**lease;
}

}  // namespace strata
