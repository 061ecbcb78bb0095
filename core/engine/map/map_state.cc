#include "core/engine/map/map_state.h"

#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"

namespace strata {

absl::StatusOr<MapState::Loan> MapState::Reader() const {
  if (core_ == nullptr) return Loan(*reader_);
  STRATA_ASSIGN_OR_RETURN(ReaderPool::Lease lease, core_->Reader());
  return Loan(std::move(lease));
}

absl::Status MapState::Snapshot(absl::FunctionRef<absl::Status(StorageReader&)> body) const {
  if (core_ == nullptr) return body(*reader_);
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease lease, core_->Reader());
  return lease->Snapshot([&] { return body(*lease); });
}

void MapState::NoteUnreadable(const TileKey& key) const {
  if (core_ != nullptr) core_->NoteUnreadable(key);
}

}  // namespace strata
