// How a new scan is tied to scans in place: registered to them, and verified as a place is where
// registration and what the robot says of its motion do not both speak for the match. A match that
// is believed and false stays in the map as a ghost, so everything doubtful is none.
#ifndef STRATA_CORE_ENGINE_INGEST_LINK_H_
#define STRATA_CORE_ENGINE_INGEST_LINK_H_

#include <optional>
#include <span>

#include "core/geometry/pose.h"
#include "core/posegraph/alignment/odometry_noise.h"
#include "core/registration/place_match.h"
#include "core/world/scan.h"

namespace strata {

struct Link {
  AlignmentReport report;  // aligned: the link holds
  Pose T_map_scan = Pose::Identity();
  Matrix6d information = Matrix6d::Zero();  // of a right-hand step on T_map_scan
};

// How sure it is that a scan shows some of what the scans around it show.
enum class Nearness {
  kSamePass,  // taken just before or after them: only where exactly is the question
  kSaid,      // the frames of two robots or runs say so
};

// Of `scan` (its pose is ignored) to `around`, in the map. `noise` is how well the robot says where
// it went, where that is known: of scans of one pass it counts beside what surfaces say, here and
// below. A pure function; REQUIRES at least one scan around.
Link LinkScan(const SeenScan& scan,
              std::span<const SeenScan> around,
              const Pose& T_map_scan_guess,
              Nearness nearness,
              const std::optional<OdometryNoise>& noise = {});

// The same to scans of any pass, for one whose place is known already: holds where they agree with
// it.
Link AgreeingLink(const SeenScan& scan,
                  std::span<const SeenScan> around,
                  const Pose& T_map_scan_known,
                  const std::optional<OdometryNoise>& noise = {});

// The same, and they are verified to show one place.
Link VerifiedLink(const SeenScan& scan,
                  std::span<const SeenScan> around,
                  const Pose& T_map_scan_known);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_LINK_H_
