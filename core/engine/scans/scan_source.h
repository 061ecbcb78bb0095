// Scans out of the store, as what they are good for: local maps and contributions to the map.
#ifndef STRATA_CORE_ENGINE_SCANS_SCAN_SOURCE_H_
#define STRATA_CORE_ENGINE_SCANS_SCAN_SOURCE_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"
#include "core/engine/scans/scan_labels.h"
#include "core/geometry/pose.h"
#include "core/mls/build.h"
#include "core/mls/measurement.h"
#include "core/mls/mls_map.h"
#include "core/registration/scan_features.h"
#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata {

// Tiles of its own frame that a scan may touch. An almost empty one takes some kilobytes on its way
// into the map, and so do those around it.
inline constexpr std::size_t kMaxScanTiles = 4'096;

// Patches of its own frame that a scan may make: its tiles are in memory at once while it is
// integrated, some 60 bytes a patch.
inline constexpr std::size_t kMaxScanPatches = std::size_t{1} << 22;

// At 0.2 m matches err twice as much (core/registration/neighbours.h).
inline constexpr double kRegistrationCellM = 0.1;

// Piece `ordinal` of the points of `scan`, with the labels it was uploaded with. DATA_LOSS, naming
// the piece, unless it is intact and has the columns that the header announces.
absl::StatusOr<PointCloud> ReadPoints(StorageReader& reader,
                                      const ScanRecord& scan,
                                      std::uint32_t ordinal);

// One thread at a time. Memory is bounded whatever a scan's size: large ones are built block by
// block and joined, which gives the same map.
class ScanSource {
 public:
  // All must outlive the source. `labels`: which labels its points have.
  ScanSource(StorageReader& reader, const MapParameters& parameters, const LabelView& labels = {})
      : reader_(reader), parameters_(parameters), labels_(labels) {}

  // The scan in its own frame. DATA_LOSS naming the piece that is damaged; INVALID_ARGUMENT for
  // points in more than kMaxScanTiles tiles and, of a scan that waits for integration, more than
  // kMaxScanPatches.
  absl::StatusOr<MlsMap> LocalMap(const ScanRecord& scan);
  // What scans are matched by: where points are there, the same with cells of kRegistrationCellM at
  // most, whatever the map's, and upright.
  absl::StatusOr<MlsMap> RegistrationMap(const ScanRecord& scan);
  // What a scan is known again by: LocalMap(), upright where points are there.
  absl::StatusOr<MlsMap> PlaceMap(const ScanRecord& scan);
  // Whether what the scan is matched by is another map than LocalMap().
  absl::StatusOr<bool> IsMatchedOtherwise(const ScanRecord& scan);
  // What the scan is matched by, of RegistrationMap(): upright surfaces where their points are, in
  // a map that keeps points.
  absl::StatusOr<ScanFeatures> Features(const ScanRecord& scan,
                                        const MlsMap& map,
                                        ScanFeatureOptions options);
  // What the scan adds to the map at this pose, without points that have faded: a pure function of
  // the scan, what is said of its points, the pose and the map's parameters, before and after
  // points were dropped.
  absl::StatusOr<MlsMap> Contribution(const ScanRecord& scan, const Pose& T_map_scan);

  // What the last map built from points had to leave out of them.
  const DroppedPoints& dropped() const { return dropped_; }

  // For the block that ForEachBlock() gives just now: not 0 for points that have faded; empty: none
  // has.
  const std::vector<std::uint16_t>& faded() const { return held_faded_; }
  // The points in blocks of about a million, in order.
  absl::Status ForEachBlock(const ScanRecord& scan,
                            absl::FunctionRef<absl::Status(const PointCloud&)> body);

 private:
  enum class Faded { kWith, kWithout };
  // The vertical in the frame of the scan. Of what becomes a map in its own frame only, that is z.
  absl::StatusOr<Eigen::Vector3d> UpIn(const ScanRecord& scan);
  absl::StatusOr<Eigen::Matrix3d> TurnOf(const ScanRecord& scan);  // R_upright_scan
  // Looks at the scan frame: what was taken once may be moved anywhere.
  absl::Status CheckSpread(const ScanRecord& scan);
  absl::StatusOr<MlsMap> Build(const ScanRecord& scan,
                               const Pose& T_map_scan,
                               const MlsParameters& parameters,
                               Faded faded,
                               std::size_t most_patches);

  StorageReader& reader_;
  const MapParameters& parameters_;
  const LabelView labels_;
  MlsScratch scratch_;
  DroppedPoints dropped_;
  // The last scan that fitted one block: its local map and its contribution read it twice.
  ScanNumber held_scan_ = 0;
  PointCloud held_;
  std::vector<std::uint16_t> held_faded_;  // ScanLabels::Faded() of the points held
  ScanNumber up_scan_ = 0;
  Eigen::Vector3d up_ = Eigen::Vector3d::UnitZ();  // UpIn() of that scan
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_SCANS_SCAN_SOURCE_H_
