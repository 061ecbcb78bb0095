// Where a new scan belongs: predicted along its trajectory, then registered to the scans around.
#ifndef STRATA_CORE_ENGINE_INGEST_ALIGNER_H_
#define STRATA_CORE_ENGINE_INGEST_ALIGNER_H_

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/disjoint_sets.h"
#include "core/common/lru_cache.h"
#include "core/engine/ingest/link.h"
#include "core/engine/scans/scan_source.h"
#include "core/posegraph/alignment/odometry_noise.h"
#include "core/registration/place_match.h"
#include "core/registration/scan_features.h"
#include "core/storage/storage.h"
#include "core/world/scan.h"

namespace strata {

// A decision about a scan's pose and what supports it.
struct Placement {
  Pose T_map_scan = Pose::Identity();
  AlignmentReport report;
  std::vector<ConstraintRecord> constraints;
};

// Knows the integrated scans and their poses. One thread at a time. Decisions depend on what was
// integrated before and on nothing else, so not on how scans were batched.
class Aligner {
 public:
  explicit Aligner(const std::shared_ptr<CacheBudget>& caches) : features_(caches) {}

  // Forgets everything and reads the integrated scans of `epoch`.
  absl::Status Load(StorageReader& reader, std::uint64_t epoch);

  using Features = std::shared_ptr<const ScanFeatures>;

  // `own`: the scan's, with a sample. Alignment::kOff: the uploaded pose. Otherwise the guess
  // (the predecessor's pose and the uploaded motion since; the uploaded pose for the first of a
  // trajectory), registered to the nearest scans of its own segment, which is what constraints say,
  // and to all around where those agree with it; where its segment says nothing, to the scans right
  // before it that are lost, too. A match that is far from the guess, degenerate or to others alone
  // is verified as a place is; so is a constraint to a segment that nothing holds to its own yet.
  // The guess if nothing holds.
  absl::StatusOr<Placement> Place(const ScanRecord& scan,
                                  const Features& own,
                                  StorageReader& reader,
                                  ScanSource& source);
  // The scan is integrated at this pose.
  void Add(const ScanRecord& scan, const Placement& placement);

 private:
  struct PlacedEntry {
    ScanNumber number;
    Pose T_map_scan_uploaded;
    Eigen::Vector3d sensor_origin;  // scan frame
    bool is_aligned = false;        // its pose is more than the robot's word
    bool is_lost = false;           // others of its pass were around, and none said where it is
    std::size_t segment = 0;        // of its trajectory, by the first scan's place in scans_
  };
  // The scans to align to.
  struct Neighbourhood {
    std::vector<Features> held;  // keeps alive what `seen` points to
    std::vector<SeenScan> seen;
    std::vector<std::size_t> indices;  // into scans_
  };

  Pose Guess(const ScanRecord& scan) const;
  // What the last steps of its trajectory before it say of the robot's word.
  std::optional<OdometryNoise> NoiseBefore(const ScanId& id) const;
  // Indices into scans_, ascending: scans of its trajectory just before and after, on its storey or
  // on the way there,
  std::vector<std::size_t> OwnPass(const ScanId& id, const Pose& guess);
  // those right before it that are lost, the last first,
  std::vector<std::size_t> LostBefore(const ScanId& id) const;
  absl::StatusOr<Features> FeaturesOf(ScanNumber number, StorageReader& reader, ScanSource& source);
  // all,
  std::vector<std::size_t> All() const;
  // without those that found no place among others, unless all are such,
  std::vector<std::size_t> Believed(const std::vector<std::size_t>& scans) const;
  // and `pass` with the scans of others that are not on another storey, which may look the same.
  std::vector<std::size_t> Around(const Pose& T_map_scan,
                                  const std::vector<std::size_t>& pass) const;
  // Without those of segments that constraints hold together with the scan's.
  std::vector<std::size_t> Apart(const ScanId& id, std::vector<std::size_t> scans);
  // A trajectory is one segment as long as each scan is tied to those before. What is tied to lost
  // scans alone begins another one with them: how it lies to the ones before nobody knows.
  std::optional<std::size_t> SegmentOf(const ScanId& id) const;
  void Tie(std::size_t scan, const std::vector<ConstraintRecord>& constraints);
  // Those of `among` around `guess`.
  absl::StatusOr<Neighbourhood> NeighboursOf(const Pose& guess,
                                             const std::vector<std::size_t>& among,
                                             StorageReader& reader,
                                             ScanSource& source);
  // Scans around `guess` by the parts of the map that constraints hold together: nothing says how
  // two of these lie. The part of the nearest scan first.
  std::vector<std::vector<std::size_t>> PartsAround(const Pose& guess);
  // Of a scan that no other of its pass is around: to the nearest part that shows the same.
  absl::StatusOr<Placement> PlaceAmongOthers(ScanNumber number,
                                             const SeenScan& seen,
                                             const Pose& guess,
                                             StorageReader& reader,
                                             ScanSource& source);
  // Of a scan that its segment says nothing about: to the last of the lost ones right before it
  // that shows the same.
  absl::StatusOr<Placement> PlaceAmongLost(const ScanRecord& scan,
                                           const SeenScan& seen,
                                           Placement placement,
                                           StorageReader& reader,
                                           ScanSource& source);
  // What a link to `partners` says about the scan, as constraints to the nearest of them.
  std::vector<ConstraintRecord> ConstraintsOf(ScanNumber number,
                                              const Link& link,
                                              std::vector<std::size_t> partners) const;
  void Keep(ScanNumber number, const Features& features);

  // By commit order.
  std::vector<PlacedEntry> scans_;
  std::vector<Pose> poses_;  // T_map_scan, beside scans_
  std::map<std::string, std::map<std::uint64_t, std::size_t>> trajectories_;  // index into scans_
  std::map<ScanNumber, std::size_t> indices_;                                 // into scans_
  DisjointSets parts_;
  LruCache<ScanNumber, const ScanFeatures> features_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_ALIGNER_H_
