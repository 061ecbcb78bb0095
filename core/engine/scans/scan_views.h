// What global consistency needs of scans, made out of the store at most once while it is wanted.
#ifndef STRATA_CORE_ENGINE_SCANS_SCAN_VIEWS_H_
#define STRATA_CORE_ENGINE_SCANS_SCAN_VIEWS_H_

#include <cstddef>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/lru_cache.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/engine/scans/scan_access.h"
#include "core/mls/mls_map.h"
#include "core/posegraph/alignment/alignment.h"
#include "core/registration/place_descriptor.h"
#include "core/storage/storage.h"

namespace strata {

// Nodes are the places of scans in the list it is made with. Thread-safe. Features are kept as far
// as they fit into the caches; descriptors and planes are kept in the store. Scans
// that answer DATA_LOSS are put into `damaged`, unless it is nullptr.
class ScanViews final : public AlignmentSource {
 public:
  ScanViews(ScanAccess access, std::vector<ScanRecord> scans, DamagedScans* damaged = nullptr);

  absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t node) override;
  absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t node) override;
  Eigen::Vector3d SensorOrigin(std::size_t node) const override {
    return scans_[node].header.sensor_origin.cast<double>();
  }
  absl::StatusOr<PlaceDescriptor> Place(std::size_t node);

  std::size_t size() const { return scans_.size(); }
  const ScanRecord& scan(std::size_t node) const { return scans_[node]; }

 private:
  absl::StatusOr<std::shared_ptr<const ScanFeatures>> MakeFeatures(const ScanRecord& scan);
  absl::StatusOr<ScanView> View(std::size_t node);
  void Remember(std::size_t node, const absl::Status& status);
  // Loads what is stored of the scan and calls `make` for what is missing.
  absl::StatusOr<ScanView> ReadView(const ScanRecord& scan);
  absl::StatusOr<ScanView> MakeView(StorageReader& reader, const ScanRecord& scan);

  const ScanAccess access_;
  const std::vector<ScanRecord> scans_;
  DamagedScans* const damaged_;
  LruCache<std::size_t, const ScanFeatures> features_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_SCANS_SCAN_VIEWS_H_
