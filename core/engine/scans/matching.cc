#include "core/engine/scans/matching.h"

#include "core/registration/upright_frame.h"

namespace strata {
namespace {

// Twice the default: a chain of hundreds of scans then drifts little whatever the sample
// (core/registration/neighbours.h has numbers).
constexpr int kSamples = 4000;

}  // namespace

ScanFeatureOptions FeatureOptionsOf(const ScanRecord& scan) {
  ScanFeatureOptions options;
  options.sample_count = kSamples;
  options.sensor_origin = scan.header.sensor_origin.cast<double>();
  options.up = UpOf(scan.header.T_map_scan);
  return options;
}

MlsRegistrationOptions EngineRegistrationOptions() {
  MlsRegistrationOptions options;
  options.max_samples = kSamples;
  return options;
}

}  // namespace strata
