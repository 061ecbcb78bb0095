// api::Scans on the maps of an engine.
#ifndef STRATA_CORE_ENGINE_DOORS_SCANS_H_
#define STRATA_CORE_ENGINE_DOORS_SCANS_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/scans.h"
#include "core/engine/doors/maps.h"

namespace strata {

class EngineScans final : public api::Scans {
 public:
  explicit EngineScans(EngineMaps& maps) : maps_(maps) {}

  absl::StatusOr<std::unique_ptr<api::ScanUpload>> Upload(const api::Call& call,
                                                          absl::string_view map,
                                                          const ScanHeader& header) override;
  absl::StatusOr<ScanAck> UploadLocalMap(const api::Call& call,
                                         absl::string_view map,
                                         const ScanHeader& header,
                                         const MlsParameters& parameters,
                                         absl::string_view local_map) override;
  absl::StatusOr<UploadState> GetUploadState(const api::Call& call,
                                             absl::string_view map,
                                             absl::string_view trajectory) override;
  absl::StatusOr<ScanInfo> Get(const api::Call& call,
                               absl::string_view map,
                               const ScanId& id) override;
  absl::Status List(const api::Call& call,
                    absl::string_view map,
                    const api::ScanFilter& filter,
                    absl::FunctionRef<absl::Status(const ScanInfo&)> sink) override;
  absl::Status GetPoints(const api::Call& call,
                         absl::string_view map,
                         const ScanId& id,
                         absl::FunctionRef<absl::Status(const PointCloud&)> sink) override;
  absl::StatusOr<std::vector<std::uint16_t>> GetFaded(const api::Call& call,
                                                      absl::string_view map,
                                                      const ScanId& id) override;
  absl::Status SetLabels(const api::Call& call,
                         absl::string_view map,
                         const ScanId& id,
                         const std::vector<std::uint16_t>& labels,
                         api::LabelMode mode) override;
  absl::Status Delete(const api::Call& call, absl::string_view map, const ScanId& id) override;

 private:
  EngineMaps& maps_;
};

// A scan as the api shows it.
ScanInfo ToScanInfo(const PosedScan& posed);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_SCANS_H_
