// The pose graph: where scans are, and what holds them there.
#ifndef STRATA_CORE_API_POSEGRAPH_H_
#define STRATA_CORE_API_POSEGRAPH_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/call.h"
#include "core/world/constraint.h"
#include "core/world/localization.h"
#include "core/world/tracking.h"

namespace strata::api {

// One consistent state.
struct PoseGraphState {
  std::uint64_t epoch = 0;
  std::vector<PoseNode> nodes;          // in commit order
  std::vector<Constraint> constraints;  // by id
  std::vector<GlobalPlane> planes;      // by id
};

// Where a scan is, or why that is not known yet.
struct PoseLookup {
  bool known = false;
  std::string message;  // why not, for people: pending behind so many scans, failed and why
  Pose T_map_scan = Pose::Identity();  // the uploaded pose unless known
  std::uint64_t epoch = 0;
};

// A robot that is being followed. Not thread-safe; destroying it ends that.
class Tracking {
 public:
  virtual ~Tracking() = default;

  // Where the robot is at its next moment; steps come in the order of time. Being lost is an
  // answer. INVALID_ARGUMENT for a step that is not valid (ValidateTrackStep), which counts for
  // nothing. RESOURCE_EXHAUSTED for a cloud beyond the server's limit; this and other errors of a
  // server are its last answer: one begins again then, with the last pose as the guess.
  virtual absl::StatusOr<TrackedPose> Step(const TrackStep& step) = 0;
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
  // Records what a person knows; the next optimize job uses it. Id and origin of `constraint` are
  // ignored; returns it as recorded. INVALID_ARGUMENT (ValidateConstraint); NOT_FOUND for a scan.
  virtual absl::StatusOr<Constraint> AddConstraint(const Call& call,
                                                   absl::string_view map,
                                                   const Constraint& constraint) = 0;
  // NOT_FOUND, also when repeated. A plane found by a job is disabled rather than removed, or the
  // next job finds it again: FAILED_PRECONDITION.
  virtual absl::Status RemoveConstraint(const Call& call,
                                        absl::string_view map,
                                        std::uint64_t id) = 0;
  // Switches a constraint or a global plane on or off for the jobs to come. NOT_FOUND.
  virtual absl::Status EnableConstraint(const Call& call,
                                        absl::string_view map,
                                        std::uint64_t id,
                                        bool enabled) = 0;
  // NOT_FOUND for a scan that was never acknowledged.
  virtual absl::StatusOr<PoseLookup> LookupPose(const Call& call,
                                                absl::string_view map,
                                                const ScanId& id) = 0;
  // Where `query.cloud` was taken; changes nothing. INVALID_ARGUMENT for a bad cloud, guess or
  // sensor; RESOURCE_EXHAUSTED for a cloud beyond the server's limit.
  virtual absl::StatusOr<LocalizeResult> Localize(const Call& call,
                                                  absl::string_view map,
                                                  const LocalizeQuery& query) = 0;
  // Follows a robot by its odometry and its scans, which are matched to the surfaces that the map
  // has at the time, points or no points; changes nothing. `call` is that of every step.
  // INVALID_ARGUMENT (ValidateTrackStart).
  virtual absl::StatusOr<std::unique_ptr<Tracking>> Track(const Call& call,
                                                          absl::string_view map,
                                                          const TrackStart& start) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_POSEGRAPH_H_
