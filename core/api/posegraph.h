// The pose graph: where scans are, and what holds them there.
#ifndef STRATA_CORE_API_POSEGRAPH_H_
#define STRATA_CORE_API_POSEGRAPH_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/call.h"
#include "core/world/constraint.h"

namespace strata::api {

// One consistent state.
struct PoseGraphState {
  std::uint64_t epoch = 0;
  std::vector<PoseNode> nodes;          // in commit order
  std::vector<Constraint> constraints;  // by id
};

// Thread-safe.
class PoseGraph {
 public:
  virtual ~PoseGraph() = default;

  virtual absl::StatusOr<PoseGraphState> Get(const Call& call, absl::string_view map) = 0;
  // Moves a scan by hand: recorded as a decision, its tiles re-made before the call returns.
  // INVALID_ARGUMENT for a bad pose; NOT_FOUND; FAILED_PRECONDITION while the scan is pending.
  virtual absl::Status SetPose(const Call& call,
                               absl::string_view map,
                               const ScanId& id,
                               const Pose& T_map_scan) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_POSEGRAPH_H_
