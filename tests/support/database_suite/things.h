// Blocks of a kind on a floor, for the suites of things and of what is inferred of them.
#ifndef STRATA_TESTS_SUPPORT_DATABASE_SUITE_THINGS_H_
#define STRATA_TESTS_SUPPORT_DATABASE_SUITE_THINGS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/api/database.h"
#include "core/cloud/point_cloud.h"
#include "core/world/job.h"
#include "core/world/things/entity.h"
#include "core/world/things/inferred.h"
#include "tests/support/database_suite/database_suite.h"

namespace strata::testing {

inline constexpr std::uint16_t kGroundClass = 1;
inline constexpr std::uint16_t kThingClass = 2;

// The sides and the top of a block that stands on the floor, a point every 5 cm from 10 cm up.
void AddBlock(const Eigen::Vector3f& low, const Eigen::Vector3f& size, PointCloud& cloud);

// The job `objects` of the class "thing", which succeeds.
JobInfo FindKinds(api::Database& db, const std::string& map = kMap);
std::vector<Entity> EntitiesWith(api::Database& db,
                                 const EntityQuery& query = {},
                                 const std::string& map = kMap);

// Two of a kind, scans {"run", 1} and {"run", 2} of one each; of the second, at kHalfLow, what is
// away from the sensor, x > 2.5, was not seen. All of the floor was.
inline const Eigen::Vector3f kHalfLow(2.0F, -2.0F, 0.0F);
inline const Eigen::Vector3f kHalfSize(0.8F, 0.6F, 1.0F);
void PutWholeAndHalf(api::Database& db);

absl::StatusOr<std::vector<InferredPart>> InferredOf(api::Database& db,
                                                     const EntityQuery& query = {});

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_DATABASE_SUITE_THINGS_H_
