// Scans that are known by their number, in every process.
#ifndef STRATA_TESTS_INTEGRATION_NUMBERED_SCANS_H_
#define STRATA_TESTS_INTEGRATION_NUMBERED_SCANS_H_

#include <cstddef>
#include <cstdint>
#include <random>

#include "core/cloud/point_cloud.h"
#include "core/world/scan.h"
#include "core/world/scan_hash.h"

namespace strata::testing {

inline PointCloud NumberedCloud(std::uint64_t sequence, std::size_t points) {
  std::mt19937 random(static_cast<std::uint32_t>(sequence));
  PointCloud cloud;
  for (std::size_t i = 0; i < points; ++i) {
    // Plain arithmetic, and nothing that packs well.
    const auto draw = [&random] { return static_cast<float>(random() % 100'000) * 2e-4F - 10.0F; };
    cloud.points.emplace_back(draw(), draw(), 0.1F * draw());
  }
  return cloud;
}

// Announced.
inline ScanHeader NumberedHeader(std::uint64_t sequence, const PointCloud& cloud) {
  ScanHeader header;
  header.id = {"run", sequence};
  header.alignment = Alignment::kOff;
  header.point_count = cloud.size();
  header.has_label = !cloud.label.empty();
  header.content_hash = ContentHashOf(header, cloud);
  return header;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_NUMBERED_SCANS_H_
