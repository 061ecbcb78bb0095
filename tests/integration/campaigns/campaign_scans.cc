#include "tests/integration/campaigns/campaign_scans.h"

#include "core/world/scan_hash.h"
#include "tests/integration/marked_yard.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"

namespace strata::testing {
namespace {

std::uint64_t SeedOf(const ScanId& id) {
  std::uint64_t seed = 7 * id.sequence;
  for (const char c : id.trajectory) seed = 131 * seed + static_cast<unsigned char>(c);
  return seed;
}

}  // namespace

PointCloud CampaignCloud(const ScanId& id, int columns) {
  static const Scene* const yard = new Scene(YardScene());
  SensorOptions sensor;
  sensor.rings = 32;
  sensor.columns = columns;
  return SimulateScan(*yard, sensor, YardTruth(id), SeedOf(id));
}

ScanHeader CampaignHeader(const ScanId& id, const PointCloud& cloud, Alignment alignment) {
  ScanHeader header;
  header.id = id;
  header.time = absl::UnixEpoch() + absl::Seconds(id.sequence);
  header.T_map_scan = YardTruth(id);
  header.alignment = alignment;
  if (alignment == Alignment::kOn) {
    Random random(SeedOf(id));
    for (double& t : header.T_map_scan.translation()) t += 0.03 * random.Gaussian();
  }
  header.point_count = cloud.size();
  header.content_hash = ContentHashOf(header, cloud);
  return header;
}

}  // namespace strata::testing
