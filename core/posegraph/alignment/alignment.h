// Poses, correspondences and planes estimated in turns until the poses settle (thesis 7.4.3,
// Algorithm 4).
//
// A round: every scan is registered to the scans around it (class-wise ICP), the planes that
// several scans see are looked for at the current poses, and all poses are optimised under both. A
// scan is registered to a chain of scans as a whole, a pooled local map (7.3.4): against single
// scans of a sparse sensor the campus loop of tests/experiments drifts eight times as far. Where it
// has hardly moved since, its correspondences are kept.
#ifndef STRATA_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_H_
#define STRATA_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_H_

#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/planes/scan_planes.h"
#include "core/planes/shared_planes.h"
#include "core/posegraph/pose_graph.h"
#include "core/registration/mls_registration.h"
#include "core/registration/neighbours.h"
#include "core/registration/scan_features.h"

namespace strata {

// The scans, by the number of their node. Called from several threads if the caller's `ForEach`
// has several. Errors end the alignment, but DATA_LOSS only leaves out what it is about.
class AlignmentSource {
 public:
  virtual ~AlignmentSource() = default;
  // With a sample, in the scan's frame.
  virtual absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t node) = 0;
  virtual absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t node) = 0;
  // Scan frame [m].
  virtual Eigen::Vector3d SensorOrigin(std::size_t /*node*/) const {
    return Eigen::Vector3d::Zero();
  }
};

struct MeasuredPose {
  Pose T_i_j = Pose::Identity();
  Matrix6d information = Matrix6d::Identity();
};

// Two scans that overlap.
struct ScanPair {
  std::size_t i = 0, j = 0;
  bool may_be_false = false;  // a closure
  // What is known before any registration, used while nothing around j can be registered: the
  // poses' own relative pose, taken to be known to these.
  double sigma_m = 0.3;
  double sigma_rad = 0.03;
  // What registration said when j came in, while only scans before it were known: independent of
  // everything after, and used as long as the poses agree with it.
  std::optional<MeasuredPose> measured = std::nullopt;
};

// Registration leaves loose what it knows less than this many times as well as odometry.
inline constexpr double kLooseShare = 4.0;

// A plane that must not be used where these scans support it.
struct ExcludedPlane {
  Plane plane_map;
  std::vector<std::size_t> nodes;
};

struct AlignmentProblem {
  std::vector<Pose> T_map_scan;  // where to start from
  std::vector<bool> fixed;       // empty: none
  // Nodes of every run of a robot in the order of its way; each node once.
  std::vector<std::vector<std::size_t>> trajectories;
  std::vector<ScanPair> pairs;  // known to overlap, however far apart they seem
  // Nodes that nothing was found of behind them when they came in: a match of theirs that leaves a
  // direction as it was joins nothing, since it agrees with any place.
  std::vector<std::size_t> lost;
  // That stay as they are: what a person said. Those that may be false are rejected as matches are.
  std::vector<RelativePoseTerm> relative;
  // What robots say of their motion from i to j, each the scan before j on its trajectory. Where a
  // trajectory is long enough to tell how good that is, it counts as much; elsewhere, and by its
  // information, in the directions that registration leaves loose: on a floor with nothing on it,
  // say, it knows neither place nor heading.
  std::vector<RelativePoseTerm> odometry;
  std::vector<PriorTerm> priors;
  std::vector<std::pair<std::size_t, std::size_t>> excluded_pairs;  // never held against each other
  std::vector<ExcludedPlane> excluded_planes;
};

struct AlignmentOptions {
  MlsRegistrationOptions registration;
  bool planes = true;
  // Scans of a built world are turned alike by the directions its surfaces face in, shared or not.
  bool directions = false;
  // Its pose_sigma is that of the poses given: where it is more than the default, the search
  // narrows to the default as poses settle.
  SharedPlaneOptions shared_planes;
  PoseGraphOptions pose_graph;
  // In [1, 100]; as many again where steps turn out false at the end of them.
  int max_rounds = 30;
  // Settled once no scan moved farther in a round, or in two where poses swing: as much as a
  // registration is good for.
  double settled_m = 0.01;
  double settled_rad = 0.001;
  // A registration is good to this beside what its information says: neighbouring features err
  // together, and scans are not rigid.
  double registration_sigma_m = 0.01;
  double registration_sigma_rad = 0.001;
  // What a scan is registered to, chosen anew each round.
  NeighbourPolicy neighbours;
};

// The numbers of one round.
struct AlignmentRound {
  std::size_t matches = 0;     // of a scan to a chain of scans, in force
  std::size_t registered = 0;  // anew in this round, successful or not
  std::size_t planes = 0;
  std::size_t supports = 0;  // of planes
  std::size_t directions = 0;
  PoseGraphCosts before, after;
  double max_shift_m = 0.0, max_turn_rad = 0.0;  // of a scan in this round
};

// A relative pose that counts nothing in the end.
struct RejectedMatch {
  RelativePoseTerm term;
  double chi2 = 0.0;   // at the final poses
  bool given = false;  // one of AlignmentProblem::relative
};

enum class AlignmentTermination { kSettled, kMaxRounds };

struct AlignmentResult {
  std::vector<Pose> T_map_scan;
  std::vector<AlignmentRound> rounds;
  AlignmentTermination termination = AlignmentTermination::kMaxRounds;
  // What the last round held. `rejected`: terms that turned out to be false, those of
  // AlignmentProblem::relative first; `measured`: matches that did not.
  std::vector<RelativePoseTerm> measured;
  std::vector<RejectedMatch> rejected;
  std::size_t rejected_priors = 0, priors = 0;  // of AlignmentProblem::priors
  std::vector<SharedPlane> planes;              // of the last round, at the final poses
  std::vector<NodeResidual> worst_nodes;
  // Beside T_map_scan: nodes that matches and given terms join have the same number. What only
  // odometry, poses as they were or planes hold is a part of its own.
  std::vector<std::size_t> parts;
  // Nodes that may slide against what is behind them: matches leave a direction to what their robot
  // says of its motion (AlignmentProblem::odometry), ascending.
  std::vector<std::size_t> sliding;
};

// Runs body(k) for every k in [0, count), in any order, maybe from several threads.
using ForEach = absl::FunctionRef<absl::Status(std::size_t count,
                                               absl::FunctionRef<absl::Status(std::size_t)> body)>;
// One after the other.
absl::Status ForEachInTurn(std::size_t count, absl::FunctionRef<absl::Status(std::size_t)> body);

// Told how far it is, in [0, 1]; may end the work.
using AlignmentProgress = absl::FunctionRef<absl::Status(double progress)>;

// `options` must be valid. INVALID_ARGUMENT for a problem with indices or poses that are none. The
// result does not depend on how `for_each` spreads the work.
absl::StatusOr<AlignmentResult> AlignScans(const AlignmentProblem& problem,
                                           AlignmentSource& source,
                                           const AlignmentOptions& options,
                                           ForEach for_each,
                                           AlignmentProgress progress,
                                           const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_H_
