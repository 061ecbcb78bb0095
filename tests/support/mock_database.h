// A database whose every answer a test decides. Constructors and destructors are in the source:
// wherever they stand, the compiler makes all methods' mocks, which takes it fifteen seconds.
#ifndef STRATA_TESTS_SUPPORT_MOCK_DATABASE_H_
#define STRATA_TESTS_SUPPORT_MOCK_DATABASE_H_

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "core/api/database.h"

namespace strata::testing {

using StringMap = std::map<std::string, std::string>;
using Profiles = std::map<std::string, RobotProfile>;
template <typename T>
using Sink = absl::FunctionRef<absl::Status(const T&)>;

class MockMaps : public api::Maps {
 public:
  MockMaps();
  ~MockMaps() override;

  MOCK_METHOD(absl::StatusOr<MapInfo>,
              Create,
              (const api::Call&, absl::string_view, const MapParameters&),
              (override));
  MOCK_METHOD(absl::StatusOr<MapInfo>, Get, (const api::Call&, absl::string_view), (override));
  MOCK_METHOD(absl::StatusOr<std::vector<MapInfo>>, List, (const api::Call&), (override));
  MOCK_METHOD(absl::Status, Delete, (const api::Call&, absl::string_view), (override));
  MOCK_METHOD(absl::StatusOr<MapStats>, Stats, (const api::Call&, absl::string_view), (override));
  MOCK_METHOD(absl::StatusOr<std::vector<EpochInfo>>,
              History,
              (const api::Call&, absl::string_view),
              (override));
  MOCK_METHOD(absl::StatusOr<std::vector<MapClass>>,
              ListClasses,
              (const api::Call&, absl::string_view),
              (override));
  MOCK_METHOD(absl::Status,
              SetClass,
              (const api::Call&, absl::string_view, const MapClass&),
              (override));
  MOCK_METHOD(absl::Status,
              SetOrigin,
              (const api::Call&, absl::string_view, const GeodeticOrigin&),
              (override));
  MOCK_METHOD(absl::Status,
              Watch,
              (const api::Call&, absl::string_view, const api::WatchOptions&, Sink<api::MapUpdate>),
              (override));
  MOCK_METHOD(absl::Status,
              Backup,
              (const api::Call&, absl::string_view, Sink<api::BackupPiece>),
              (override));
};

class MockScanUpload : public api::ScanUpload {
 public:
  MockScanUpload();
  ~MockScanUpload() override;

  MOCK_METHOD(std::uint64_t, points_held, (), (const, override));
  MOCK_METHOD(absl::Status, Write, (const PointCloud&), (override));
  MOCK_METHOD(absl::StatusOr<ScanAck>, Finish, (), (override));
};

class MockScans : public api::Scans {
 public:
  MockScans();
  ~MockScans() override;

  MOCK_METHOD(absl::StatusOr<std::unique_ptr<api::ScanUpload>>,
              Upload,
              (const api::Call&, absl::string_view, const ScanHeader&),
              (override));
  MOCK_METHOD(absl::StatusOr<ScanAck>,
              UploadLocalMap,
              (const api::Call&,
               absl::string_view,
               const ScanHeader&,
               const MlsParameters&,
               absl::string_view),
              (override));
  MOCK_METHOD(absl::StatusOr<UploadState>,
              GetUploadState,
              (const api::Call&, absl::string_view, absl::string_view),
              (override));
  MOCK_METHOD(absl::StatusOr<ScanInfo>,
              Get,
              (const api::Call&, absl::string_view, const ScanId&),
              (override));
  MOCK_METHOD(absl::Status,
              List,
              (const api::Call&, absl::string_view, const api::ScanFilter&, Sink<ScanInfo>),
              (override));
  MOCK_METHOD(absl::Status,
              GetPoints,
              (const api::Call&, absl::string_view, const ScanId&, Sink<PointCloud>),
              (override));
  MOCK_METHOD(absl::StatusOr<std::vector<std::uint16_t>>,
              GetFaded,
              (const api::Call&, absl::string_view, const ScanId&),
              (override));
  MOCK_METHOD(absl::Status,
              SetLabels,
              (const api::Call&,
               absl::string_view,
               const ScanId&,
               const std::vector<std::uint16_t>&,
               api::LabelMode),
              (override));
  MOCK_METHOD(absl::Status,
              Delete,
              (const api::Call&, absl::string_view, const ScanId&),
              (override));
};

class MockTiles : public api::Tiles {
 public:
  MockTiles();  // GetAtHand has nothing
  ~MockTiles() override;

  MOCK_METHOD(absl::StatusOr<std::optional<api::EncodedTile>>,
              GetAtHand,
              (const api::Call&, absl::string_view, const TileKey&),
              (override));
  MOCK_METHOD(absl::StatusOr<api::EncodedTile>,
              Get,
              (const api::Call&, absl::string_view, const TileKey&),
              (override));
  MOCK_METHOD(absl::StatusOr<std::vector<api::TileInfo>>,
              List,
              (const api::Call&, absl::string_view, const api::TileArea&),
              (override));
  MOCK_METHOD(absl::Status,
              Fetch,
              (const api::Call&,
               absl::string_view,
               const api::TileArea&,
               const std::vector<api::HeldTile>&,
               Sink<api::TileUpdate>),
              (override));
};

class MockPlanning : public api::Planning {
 public:
  MockPlanning();
  ~MockPlanning() override;

  MOCK_METHOD(absl::StatusOr<PlanResult>,
              PlanPath,
              (const api::Call&, absl::string_view, const PlanQuery&),
              (override));
  MOCK_METHOD(absl::StatusOr<PathCheck>,
              CheckPath,
              (const api::Call&, absl::string_view, const PathQuery&),
              (override));
  MOCK_METHOD(absl::Status,
              WatchPath,
              (const api::Call&, absl::string_view, const PathQuery&, Sink<PathCheck>),
              (override));
  MOCK_METHOD(absl::StatusOr<FloorPlan>,
              ListFloors,
              (const api::Call&, absl::string_view, const FloorQuery&),
              (override));
  MOCK_METHOD(absl::StatusOr<FloorPlaces>,
              ListPlaces,
              (const api::Call&, absl::string_view, const PlaceQuery&),
              (override));
  MOCK_METHOD(absl::StatusOr<ExploreResult>,
              Explore,
              (const api::Call&, absl::string_view, const ExploreQuery&),
              (override));
  MOCK_METHOD(absl::StatusOr<ShapeCheck>,
              CheckShape,
              (const api::Call&, absl::string_view, const ShapeQuery&),
              (override));
  MOCK_METHOD(absl::StatusOr<std::vector<SurfaceColumn>>,
              SampleSurfaces,
              (const api::Call&, absl::string_view, const std::vector<Eigen::Vector2d>&),
              (override));
  MOCK_METHOD(absl::Status,
              SetProfile,
              (const api::Call&, absl::string_view, absl::string_view, const RobotProfile&),
              (override));
  MOCK_METHOD(absl::StatusOr<Profiles>,
              ListProfiles,
              (const api::Call&, absl::string_view),
              (override));
};

class MockJobs : public api::Jobs {
 public:
  MockJobs();
  ~MockJobs() override;

  MOCK_METHOD(absl::StatusOr<JobInfo>,
              Start,
              (const api::Call&, absl::string_view, absl::string_view, const StringMap&),
              (override));
  MOCK_METHOD(absl::StatusOr<JobInfo>,
              Get,
              (const api::Call&, absl::string_view, std::uint64_t),
              (override));
  MOCK_METHOD(absl::StatusOr<std::vector<JobInfo>>,
              List,
              (const api::Call&, absl::string_view),
              (override));
  MOCK_METHOD(absl::StatusOr<JobInfo>,
              Cancel,
              (const api::Call&, absl::string_view, std::uint64_t),
              (override));
  MOCK_METHOD(absl::StatusOr<JobInfo>,
              Accept,
              (const api::Call&, absl::string_view, std::uint64_t),
              (override));
  MOCK_METHOD(absl::StatusOr<JobInfo>,
              Revert,
              (const api::Call&, absl::string_view, std::uint64_t),
              (override));
  MOCK_METHOD(absl::Status,
              Watch,
              (const api::Call&, absl::string_view, std::uint64_t, Sink<JobInfo>),
              (override));
};

class MockPoseGraph : public api::PoseGraph {
 public:
  MockPoseGraph();
  ~MockPoseGraph() override;

  MOCK_METHOD(absl::StatusOr<api::PoseGraphState>,
              Get,
              (const api::Call&, absl::string_view),
              (override));
  MOCK_METHOD(absl::Status,
              SetPose,
              (const api::Call&, absl::string_view, const ScanId&, const Pose&),
              (override));
  MOCK_METHOD(absl::StatusOr<Constraint>,
              AddConstraint,
              (const api::Call&, absl::string_view, const Constraint&),
              (override));
  MOCK_METHOD(absl::Status,
              RemoveConstraint,
              (const api::Call&, absl::string_view, std::uint64_t),
              (override));
  MOCK_METHOD(absl::Status,
              EnableConstraint,
              (const api::Call&, absl::string_view, std::uint64_t, bool),
              (override));
  MOCK_METHOD(absl::StatusOr<api::PoseLookup>,
              LookupPose,
              (const api::Call&, absl::string_view, const ScanId&),
              (override));
  MOCK_METHOD(absl::StatusOr<LocalizeResult>,
              Localize,
              (const api::Call&, absl::string_view, const LocalizeQuery&),
              (override));
  MOCK_METHOD(absl::StatusOr<std::unique_ptr<api::Tracking>>,
              Track,
              (const api::Call&, absl::string_view, const TrackStart&),
              (override));
};

class MockClassifiers : public api::Classifiers {
 public:
  MockClassifiers();
  ~MockClassifiers() override;

  MOCK_METHOD(absl::StatusOr<ClassifierInfo>,
              Get,
              (const api::Call&, absl::string_view, absl::string_view),
              (override));
  MOCK_METHOD(absl::StatusOr<std::vector<ClassifierInfo>>,
              List,
              (const api::Call&, absl::string_view),
              (override));
  MOCK_METHOD(absl::Status,
              Delete,
              (const api::Call&, absl::string_view, absl::string_view),
              (override));
  MOCK_METHOD(absl::Status,
              Export,
              (const api::Call&,
               absl::string_view,
               absl::string_view,
               absl::FunctionRef<absl::Status(absl::string_view)>),
              (override));
  MOCK_METHOD(absl::StatusOr<ClassifierInfo>,
              Import,
              (const api::Call&, absl::string_view, absl::string_view, absl::string_view),
              (override));
};

class MockModels : public api::Models {
 public:
  MockModels();
  ~MockModels() override;

  MOCK_METHOD(absl::StatusOr<PlaneModelInfo>,
              GetPlaneModel,
              (const api::Call&, absl::string_view, Sink<ModelPlane>),
              (override));
};

class MockObjects : public api::Objects {
 public:
  MockObjects();
  ~MockObjects() override;

  MOCK_METHOD(absl::StatusOr<EntitiesInfo>,
              ListEntities,
              (const api::Call&, absl::string_view, const EntityQuery&, Sink<Entity>),
              (override));
  MOCK_METHOD(absl::StatusOr<std::vector<KindInfo>>,
              ListKinds,
              (const api::Call&, absl::string_view),
              (override));
  MOCK_METHOD(absl::StatusOr<ThingKind>,
              GetKind,
              (const api::Call&, absl::string_view, absl::string_view),
              (override));
  MOCK_METHOD(absl::StatusOr<KindInfo>,
              RenameKind,
              (const api::Call&, absl::string_view, absl::string_view, absl::string_view),
              (override));
  MOCK_METHOD(absl::StatusOr<KindInfo>,
              ImportKind,
              (const api::Call&, absl::string_view, const NewKind&),
              (override));
  MOCK_METHOD(absl::Status,
              DeleteKind,
              (const api::Call&, absl::string_view, absl::string_view),
              (override));
  MOCK_METHOD(absl::StatusOr<InferredInfo>,
              ListInferred,
              (const api::Call&, absl::string_view, const EntityQuery&, Sink<InferredPart>),
              (override));
};

// Calls nobody decided on answer UNKNOWN (gmock's default of a StatusOr).
class MockDatabase : public api::Database {
 public:
  MockDatabase();
  ~MockDatabase() override;

  ::testing::NiceMock<MockMaps>& maps() override { return maps_; }
  ::testing::NiceMock<MockScans>& scans() override { return scans_; }
  ::testing::NiceMock<MockTiles>& tiles() override { return tiles_; }
  ::testing::NiceMock<MockPlanning>& planning() override { return planning_; }
  ::testing::NiceMock<MockJobs>& jobs() override { return jobs_; }
  ::testing::NiceMock<MockPoseGraph>& posegraph() override { return posegraph_; }
  ::testing::NiceMock<MockClassifiers>& classifiers() override { return classifiers_; }
  ::testing::NiceMock<MockModels>& models() override { return models_; }
  ::testing::NiceMock<MockObjects>& objects() override { return objects_; }

 private:
  ::testing::NiceMock<MockMaps> maps_;
  ::testing::NiceMock<MockScans> scans_;
  ::testing::NiceMock<MockTiles> tiles_;
  ::testing::NiceMock<MockPlanning> planning_;
  ::testing::NiceMock<MockJobs> jobs_;
  ::testing::NiceMock<MockPoseGraph> posegraph_;
  ::testing::NiceMock<MockClassifiers> classifiers_;
  ::testing::NiceMock<MockModels> models_;
  ::testing::NiceMock<MockObjects> objects_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_MOCK_DATABASE_H_
