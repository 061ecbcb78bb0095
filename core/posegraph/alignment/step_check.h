// Does what was found of a robot's step hold, looked at once poses have settled? For steps that
// nobody verified when they were matched, or that say something else than the robot.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_ALIGNMENT_STEP_CHECK_H_
#define STRATA_CORE_POSEGRAPH_ALIGNMENT_STEP_CHECK_H_

#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"

#include "core/geometry/pose.h"
#include "core/posegraph/alignment/alignment.h"
#include "core/registration/mls_registration.h"

namespace strata {

struct DoubtfulStep {
  std::vector<std::size_t> before;  // nodes, nearest to the step first; not empty
  std::vector<std::size_t> after;   // the same; the step leads to the first
  // What carries those after it from where they are to where the robot's word has them.
  Pose T_said_found = Pose::Identity();
  bool is_verified = false;  // what was found was, when the scan came in
};

// A scan after the step speaks for it where it shows what those before it show, there rather than
// anywhere else within reach of what was found and of what was said (SaidHypothesis), and neither
// looks through what the other saw; it speaks against the step where it fits better elsewhere, or
// is contradicted. A step does not hold where two or more speak against it and fewer for it, or as
// many and it was never verified. Damaged scans say nothing. Costs some ten ms a scan.
absl::StatusOr<bool> StepHolds(const DoubtfulStep& step,
                               const std::vector<Pose>& T_map_scan,
                               AlignmentSource& source,
                               const MlsRegistrationOptions& registration);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_ALIGNMENT_STEP_CHECK_H_
