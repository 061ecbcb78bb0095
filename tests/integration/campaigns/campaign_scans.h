// Scans of the robots in the yard that every process makes alike from their id: a robot that sends
// them, and a campaign that wants to know what must have arrived.
#ifndef STRATA_TESTS_INTEGRATION_CAMPAIGN_SCANS_H_
#define STRATA_TESTS_INTEGRATION_CAMPAIGN_SCANS_H_

#include "core/cloud/point_cloud.h"
#include "core/world/scan.h"

namespace strata::testing {

inline constexpr char kCampaignMap[] = "world";

// One turn of a sensor with 32 rings in the yard, where YardTruth(id) has it; most of its
// 32 · columns beams come back.
PointCloud CampaignCloud(const ScanId& id, int columns);
// Announced; with alignment its pose is a little off the truth.
ScanHeader CampaignHeader(const ScanId& id, const PointCloud& cloud, Alignment alignment);

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_CAMPAIGN_SCANS_H_
