#include "core/engine/scans/scan_views.h"

#include <utility>

#include "absl/status/status.h"

#include "core/common/status.h"
#include "core/engine/scans/matching.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/scans/scan_source.h"
#include "core/planes/extraction.h"
#include "core/planes/scan_planes_codec.h"

namespace strata {
namespace {

// Larger clouds are looked at in their local map, so that memory stays bounded.
constexpr std::uint64_t kMaxPlanePoints = 2'000'000;

absl::StatusOr<ScanPlanes> PlanesOf(ScanSource& source,
                                    const ScanRecord& scan,
                                    const MapParameters& parameters) {
  PlaneExtractionOptions options;
  options.sensor = scan.header.sensor.value_or(parameters.sensor);
  options.sensor_origin = scan.header.sensor_origin;
  if (!scan.has_points || scan.header.point_count > kMaxPlanePoints) {
    STRATA_ASSIGN_OR_RETURN(const MlsMap local_map, source.LocalMap(scan));
    return ExtractPlanes(local_map, options);
  }
  PointCloud cloud;
  cloud.sensor_origin = scan.header.sensor_origin;
  STRATA_RETURN_IF_ERROR(source.ForEachBlock(scan, [&cloud](const PointCloud& block) {
    cloud.points.insert(cloud.points.end(), block.points.begin(), block.points.end());
    return absl::OkStatus();
  }));
  cloud.rows = scan.header.rows;
  cloud.columns = scan.header.columns;
  return ExtractPlanes(cloud, options);
}

}  // namespace

ScanViews::ScanViews(ScanAccess access, std::vector<ScanRecord> scans, DamagedScans* damaged)
    : access_(std::move(access)),
      scans_(std::move(scans)),
      damaged_(damaged),
      features_(access_.caches()) {}

void ScanViews::Remember(std::size_t node, const absl::Status& status) {
  if (damaged_ == nullptr || !absl::IsDataLoss(status)) return;
  const ScanRecord& scan = scans_[node];
  const absl::StatusOr<MapState::Loan> reader = access_.Reader();
  if (reader.ok()) {
    damaged_->LeaveOut(**reader, scan.number, scan.header.id.ToString(), status);
  } else {
    damaged_->LeaveOut(scan.number, scan.header.id.ToString(), status);
  }
}

absl::StatusOr<std::shared_ptr<const ScanFeatures>> ScanViews::MakeFeatures(
    const ScanRecord& scan) {
  const ScanShare share(access_.caches(), scan);
  STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, access_.Reader());
  const MapParameters parameters = access_.parameters();
  ScanSource source(*reader, parameters);
  STRATA_ASSIGN_OR_RETURN(const MlsMap map, source.RegistrationMap(scan));
  STRATA_ASSIGN_OR_RETURN(ScanFeatures features,
                          source.Features(scan, map, FeatureOptionsOf(scan)));
  return std::make_shared<const ScanFeatures>(std::move(features));
}

absl::StatusOr<std::shared_ptr<const ScanFeatures>> ScanViews::Features(std::size_t node) {
  if (auto held = features_.Find(node); held != nullptr) return held;
  auto features = MakeFeatures(scans_[node]);
  Remember(node, features.status());
  if (!features.ok()) return features;
  features_.Put(node, *features, (*features)->memory_bytes());
  return features;
}

absl::StatusOr<ScanView> ScanViews::MakeView(StorageReader& reader, const ScanRecord& scan) {
  const ScanShare share(access_.caches(), scan);
  const MapParameters parameters = access_.parameters();
  ScanSource source(reader, parameters);
  ScanView view;
  {
    STRATA_ASSIGN_OR_RETURN(const MlsMap map, source.PlaceMap(scan));
    view.place = EncodePlace(DescribePlace(map));
  }
  STRATA_ASSIGN_OR_RETURN(const ScanPlanes planes, PlanesOf(source, scan, parameters));
  view.planes = EncodeScanPlanes(planes);
  access_.Keep(scan.number, view);
  return view;
}

absl::StatusOr<ScanView> ScanViews::View(std::size_t node) {
  absl::StatusOr<ScanView> view = ReadView(scans_[node]);
  Remember(node, view.status());
  return view;
}

absl::StatusOr<ScanView> ScanViews::ReadView(const ScanRecord& scan) {
  STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, access_.Reader());
  STRATA_ASSIGN_OR_RETURN(ScanView view, reader->FindScanView(scan.number));
  if (DecodePlace(view.place).ok() && DecodeScanPlanes(view.planes).ok()) return view;
  return MakeView(*reader, scan);
}

absl::StatusOr<std::shared_ptr<const ScanPlanes>> ScanViews::Planes(std::size_t node) {
  STRATA_ASSIGN_OR_RETURN(const ScanView view, View(node));
  STRATA_ASSIGN_OR_RETURN(ScanPlanes planes, DecodeScanPlanes(view.planes));
  return std::make_shared<const ScanPlanes>(std::move(planes));
}

absl::StatusOr<PlaceDescriptor> ScanViews::Place(std::size_t node) {
  STRATA_ASSIGN_OR_RETURN(const ScanView view, View(node));
  return DecodePlace(view.place);
}

}  // namespace strata
