// Files of points in every format that people have.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include <fuzzer/FuzzedDataProvider.h>

#include "client/formats/scan_reader.h"
#include "core/cloud/point_cloud.h"
#include "tests/fuzz/input_file.h"
#include "tests/fuzz/require.h"
#include "tests/support/e57_pages.h"

namespace strata {
namespace {

constexpr std::size_t kMostStations = 20;

void TryCloud(const absl::StatusOr<PointCloud>& cloud) {
  fuzz::RequireGoodRefusal(cloud.status());
  if (cloud.ok()) fuzz::Require(ValidateCloud(*cloud).ok(), "a cloud that was read is valid");
}

}  // namespace
}  // namespace strata

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  constexpr std::array kFormats = {ScanFormat::kPcd,
                                   ScanFormat::kPly,
                                   ScanFormat::kVtk,
                                   ScanFormat::kXyz,
                                   ScanFormat::k3dtk,
                                   ScanFormat::kKitti,
                                   ScanFormat::kOakland,
                                   ScanFormat::kAuto,
                                   ScanFormat::kLas,
                                   ScanFormat::kPtx,
                                   ScanFormat::kE57,
                                   ScanFormat::kVelodyne};
  FuzzedDataProvider input(data, size);
  const ScanFormat format = input.PickValueInArray(kFormats);
  std::string bytes = input.ConsumeRemainingBytesAsString();
  if (format == ScanFormat::kE57) testing::SealE57Pages(bytes);
  const fuzz::InputFile file(bytes);
  if (HoldsStations(format)) {
    const auto stations = ListStations(file.path(), format);
    for (std::size_t i = 0; stations.ok() && i < stations->size() && i < kMostStations; ++i) {
      TryCloud((*stations)[i].read());
    }
  }
  TryCloud(ReadScan(file.path(), format));
  return 0;
}
