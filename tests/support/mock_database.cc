#include "tests/support/mock_database.h"

#include <optional>

#include <gmock/gmock.h>

namespace strata::testing {

MockMaps::MockMaps() = default;
MockMaps::~MockMaps() = default;

MockScanUpload::MockScanUpload() = default;
MockScanUpload::~MockScanUpload() = default;

MockScans::MockScans() = default;
MockScans::~MockScans() = default;

MockTiles::MockTiles() {
  ON_CALL(*this, GetAtHand).WillByDefault(::testing::Return(std::optional<api::EncodedTile>()));
}
MockTiles::~MockTiles() = default;

MockPlanning::MockPlanning() = default;
MockPlanning::~MockPlanning() = default;

MockJobs::MockJobs() = default;
MockJobs::~MockJobs() = default;

MockPoseGraph::MockPoseGraph() = default;
MockPoseGraph::~MockPoseGraph() = default;

MockClassifiers::MockClassifiers() = default;
MockClassifiers::~MockClassifiers() = default;

MockModels::MockModels() = default;
MockModels::~MockModels() = default;

MockObjects::MockObjects() = default;
MockObjects::~MockObjects() = default;

MockDatabase::MockDatabase() = default;
MockDatabase::~MockDatabase() = default;

}  // namespace strata::testing
