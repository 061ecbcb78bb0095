#include "core/storage/epoch_difference.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/world/constraint.h"

namespace strata {
namespace {

std::uint64_t IdOf(const ConstraintRecord& record) { return record.constraint.id; }
std::uint64_t IdOf(const PlaneRecord& record) { return record.plane.id; }

// The records of `a` that are not in `b`; both by id.
template <typename Record>
std::vector<Record> Missing(const std::vector<Record>& a, const std::vector<Record>& b) {
  std::vector<Record> missing;
  std::set_difference(a.begin(),
                      a.end(),
                      b.begin(),
                      b.end(),
                      std::back_inserter(missing),
                      [](const Record& x, const Record& y) { return IdOf(x) < IdOf(y); });
  return missing;
}

}  // namespace

absl::StatusOr<EpochDifference> DifferenceOfEpochs(StorageReader& reader,
                                                   std::uint64_t then,
                                                   std::uint64_t now) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<ConstraintRecord> old_constraints,
                          reader.ListConstraints(then));
  STRATA_ASSIGN_OR_RETURN(const std::vector<ConstraintRecord> new_constraints,
                          reader.ListConstraints(now));
  STRATA_ASSIGN_OR_RETURN(const std::vector<PlaneRecord> old_planes, reader.ListPlanes(then));
  STRATA_ASSIGN_OR_RETURN(const std::vector<PlaneRecord> new_planes, reader.ListPlanes(now));
  EpochDifference difference;
  for (const ConstraintRecord& record : Missing(new_constraints, old_constraints)) {
    if (record.constraint.origin != ConstraintOrigin::kOptimize) continue;
    difference.ended_constraints.push_back(IdOf(record));
  }
  for (const PlaneRecord& record : Missing(new_planes, old_planes)) {
    difference.ended_planes.push_back(IdOf(record));
  }
  difference.restored_constraints = Missing(old_constraints, new_constraints);
  difference.restored_planes = Missing(old_planes, new_planes);
  return difference;
}

}  // namespace strata
