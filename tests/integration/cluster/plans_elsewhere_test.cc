// Plans by a server that has not got the map: what its owner would answer, never of an older state,
// and without reading every tile anew.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/map_owner.h"
#include "core/common/status.h"
#include "core/storage/postgresql/connection.h"
#include "core/world/scan_hash.h"
#include "proto/translate/localize.h"
#include "proto/translate/planning.h"
#include "proto/translate/shape.h"
#include "proto/translate/track.h"
#include "tests/integration/cluster/sharing_servers.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

// A floor of 16 × 16 m around the scan's origin with a wall across it that leaves a way around.
PointCloud Hall() {
  PointCloud cloud;
  cloud.sensor_origin = {0.0F, 0.0F, 1.0F};
  for (int i = -160; i < 160; ++i) {
    for (int j = -160; j < 160; ++j) {
      cloud.points.emplace_back(0.05F * static_cast<float>(i), 0.05F * static_cast<float>(j), 0.0F);
    }
  }
  for (int j = -160; j < 100; ++j) {
    for (int k = 1; k < 16; ++k) {
      cloud.points.emplace_back(2.0F, 0.05F * static_cast<float>(j), 0.1F * static_cast<float>(k));
    }
  }
  return cloud;
}

// A floor of 8 × 8 m with two walls that meet, so that there is one way to lie on another.
PointCloud Corner() {
  PointCloud cloud;
  cloud.sensor_origin = {0.0F, 0.0F, 1.0F};
  for (int i = -80; i < 80; ++i) {
    const float along = 0.05F * static_cast<float>(i);
    for (int j = -80; j < 80; ++j) {
      cloud.points.emplace_back(along, 0.05F * static_cast<float>(j), 0.0F);
    }
    for (int k = 1; k < 40; ++k) {
      const float z = 0.05F * static_cast<float>(k);
      cloud.points.emplace_back(along, 3.0F, z);
      if (i > 0) cloud.points.emplace_back(2.5F, along - 1.0F, z);
    }
  }
  return cloud;
}

// The halls lie beside each other along x.
absl::StatusOr<ScanAck> PutHall(api::Database& db,
                                std::uint64_t number,
                                const PointCloud& cloud = Hall()) {
  ScanHeader header;
  header.id = {"run", number};
  header.alignment = Alignment::kOff;
  header.point_count = cloud.size();
  header.T_map_scan.translation().x() = 15.0 * static_cast<double>(number - 1);
  header.content_hash = ContentHashOf(header, cloud);
  STRATA_ASSIGN_OR_RETURN(const auto upload, db.scans().Upload({}, kShared, header));
  for (std::size_t begin = upload->points_held(); begin < cloud.size(); begin += 40'000) {
    PointCloud piece;
    piece.sensor_origin = cloud.sensor_origin;
    const std::size_t end = std::min(cloud.size(), begin + 40'000);
    piece.points.assign(cloud.points.begin() + static_cast<std::ptrdiff_t>(begin),
                        cloud.points.begin() + static_cast<std::ptrdiff_t>(end));
    STRATA_RETURN_IF_ERROR(upload->Write(piece));
  }
  return upload->Finish();
}

PlanQuery FromTo(double from_x_m, double to_x_m) {
  PlanQuery query;
  query.from = {from_x_m, -4.0};
  query.to = {to_x_m, -4.0};
  return query;
}

template <typename Answer>
std::string BytesOf(const Answer& answer) {
  return translate::ToProto(answer).SerializeAsString();
}

// All that Planning says of the halls which it only reads, but for how long it took.
absl::StatusOr<std::vector<std::string>> AskAll(api::Database& db, int halls) {
  api::Planning& planning = db.planning();
  const RobotProfile profile;
  std::vector<std::string> told;
  const double last_m = 15.0 * (halls - 1);
  for (const PlanQuery& query :
       {FromTo(-6.0, last_m + 6.0), FromTo(0.0, 5.0), FromTo(0.0, 1000.0)}) {
    STRATA_ASSIGN_OR_RETURN(PlanResult plan, planning.PlanPath({}, kShared, query));
    plan.elapsed_ms = 0.0;
    told.push_back(BytesOf(plan));
    if (!plan.found()) continue;
    PathQuery path{plan.waypoints, query.profile};
    STRATA_ASSIGN_OR_RETURN(const PathCheck check, planning.CheckPath({}, kShared, path));
    EXPECT_TRUE(check.valid) << check.message;
    told.push_back(BytesOf(check));
    path.known = check;
    STRATA_ASSIGN_OR_RETURN(const PathCheck again, planning.CheckPath({}, kShared, path));
    told.push_back(BytesOf(again));
  }
  STRATA_ASSIGN_OR_RETURN(const auto columns,
                          planning.SampleSurfaces({}, kShared, {{0.0, 0.0}, {2.0, 0.0}, {99, 99}}));
  for (const SurfaceColumn& column : columns) told.push_back(BytesOf(column));
  STRATA_ASSIGN_OR_RETURN(const FloorPlan floors,
                          planning.ListFloors({}, kShared, {.profile = profile, .cells = true}));
  EXPECT_EQ(floors.floors.size(), 1U);
  told.push_back(BytesOf(floors));
  ExploreQuery look;
  look.from = {0.0, -4.0};
  STRATA_ASSIGN_OR_RETURN(ExploreResult views, planning.Explore({}, kShared, look));
  views.elapsed_ms = 0.0;
  told.push_back(BytesOf(views));
  ShapeQuery shape;
  shape.shape.parts.push_back({});
  shape.poses = {Pose::Identity()};
  shape.poses.front().translation() = Eigen::Vector3d(2.0, 0.0, 0.5);
  STRATA_ASSIGN_OR_RETURN(ShapeCheck touched, planning.CheckShape({}, kShared, shape));
  touched.elapsed_ms = 0.0;
  told.push_back(BytesOf(touched));
  STRATA_ASSIGN_OR_RETURN(const auto profiles, planning.ListProfiles({}, kShared));
  for (const auto& [name, robot] : profiles) told.push_back(absl::StrCat(name, robot.radius_m));
  return told;
}

// Without the number of the call.
std::string Words(const absl::Status& status) {
  return status.ToString(absl::StatusToStringMode::kWithNoExtraData);
}

class PlansElsewhereTest : public SharingServersTest {
 protected:
  void PutHalls(std::uint64_t count) {
    for (std::uint64_t number = 1; number <= count; ++number) {
      STRATA_ASSERT_OK(PutHall(db(0), number));
    }
    STRATA_ASSERT_OK(AtRest(db(0), kShared));
  }
};

TEST_F(PlansElsewhereTest, AreTheOwnersToTheByteAndGoOnWhenItDies) {
  constexpr int kHalls = 2;
  PutHalls(kHalls);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto owners, AskAll(db(0), kHalls));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto others, AskAll(db(1), kHalls));
  EXPECT_EQ(owners, others);
  EXPECT_EQ(MapOwnerOf(AskTheOwner(db(1), kShared)), "a");
  servers_[0]->Kill();
  STRATA_ASSERT_OK_AND_ASSIGN(const auto orphaned, AskAll(db(1), kHalls));
  EXPECT_EQ(owners, orphaned);
}

// Bad queries are refused with the owner's words.
TEST_F(PlansElsewhereTest, RefuseWhatTheOwnerRefuses) {
  PutHalls(1);
  PlanQuery bad = FromTo(0.0, 1.0);
  bad.profile.radius_m = -1.0;
  EXPECT_EQ(Words(db(0).planning().PlanPath({}, kShared, bad).status()),
            Words(db(1).planning().PlanPath({}, kShared, bad).status()));
  PlaceQuery nowhere;
  nowhere.floor = 7;
  const absl::Status refused = db(1).planning().ListPlaces({}, kShared, nowhere).status();
  EXPECT_TRUE(absl::IsNotFound(refused)) << refused;
  EXPECT_EQ(Words(db(0).planning().ListPlaces({}, kShared, nowhere).status()), Words(refused));
}

// What the store holds of tiles is spoilt behind both servers' backs: who plans where he planned
// before does not find out, neither of the tiles nor of what was prepared of them.
TEST_F(PlansElsewhereTest, ReadNoTileASecondTime) {
  PutHalls(3);
  const PlanQuery query = FromTo(-6.0, 36.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult first,
                              db(0).planning().PlanPath({}, kShared, query));
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult second,
                              db(0).planning().PlanPath({}, kShared, query));
  STRATA_ASSERT_OK_AND_ASSIGN(PlanResult cold, db(1).planning().PlanPath({}, kShared, query));
  ASSERT_TRUE(cold.found()) << cold.message;
  STRATA_ASSERT_OK(db(1).planning().SampleSurfaces({}, kShared, {{0.0, 0.0}}));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::unique_ptr<Connection> connection,
                              Connection::Open(store_));
  STRATA_ASSERT_OK(connection->Execute("UPDATE derived_surface_tile SET bytes = ''"));
  STRATA_ASSERT_OK(connection->Execute("DELETE FROM derived_prepared_tile"));
  STRATA_ASSERT_OK_AND_ASSIGN(PlanResult warm, db(1).planning().PlanPath({}, kShared, query));
  std::printf("cold %.1f ms, warm %.1f ms; by the owner %.1f ms and %.1f ms\n",
              cold.elapsed_ms,
              warm.elapsed_ms,
              first.elapsed_ms,
              second.elapsed_ms);
  cold.elapsed_ms = warm.elapsed_ms = 0.0;
  EXPECT_EQ(BytesOf(cold), BytesOf(warm));
  STRATA_EXPECT_OK(db(1).planning().SampleSurfaces({}, kShared, {{0.0, 0.0}}));
  // Another robot's preparations are not there, but the tiles they are made of are.
  PlanQuery other = query;
  other.profile.radius_m = 0.2;
  STRATA_EXPECT_OK(db(1).planning().PlanPath({}, kShared, other));
}

// Taken in the hall of that number, as its robot believes.
LocalizeQuery TakenIn(std::uint64_t number) {
  LocalizeQuery query;
  query.cloud = Corner();
  query.T_map_scan_guess = Pose::Identity();
  query.T_map_scan_guess->translation() =
      Eigen::Vector3d(15.0 * static_cast<double>(number - 1) + 0.4, -0.3, 0.0);
  query.guess_radius_m = 2.0;
  return query;
}

// Answers of both servers; they are the same.
absl::StatusOr<LocalizeResult> LocalizeAt(SharingServer& owner,
                                          SharingServer& other,
                                          const LocalizeQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const LocalizeResult told,
                          other.db()->posegraph().Localize({}, kShared, query));
  STRATA_ASSIGN_OR_RETURN(const LocalizeResult owners,
                          owner.db()->posegraph().Localize({}, kShared, query));
  EXPECT_EQ(BytesOf(told), BytesOf(owners));
  return told;
}

TEST_F(PlansElsewhereTest, LocalizeInTheMapAsItIsNow) {
  for (std::uint64_t hall = 1; hall <= 4; ++hall) {
    STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeResult before,
                                LocalizeAt(*servers_[0], *servers_[1], TakenIn(hall)));
    EXPECT_FALSE(before.found) << hall;
    STRATA_ASSERT_OK(PutHall(db(hall % 2), hall, Corner()));
    STRATA_ASSERT_OK(AtRest(db(0), kShared));
    STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeResult there,
                                LocalizeAt(*servers_[0], *servers_[1], TakenIn(hall)));
    ASSERT_TRUE(there.found) << there.message;
    EXPECT_NEAR(there.best.T_map_scan.translation().x(), 15.0 * static_cast<double>(hall - 1), 0.1);
  }
  LocalizeQuery anywhere = TakenIn(1);
  anywhere.T_map_scan_guess.reset();
  STRATA_EXPECT_OK(LocalizeAt(*servers_[0], *servers_[1], anywhere));
  LocalizeQuery bad = TakenIn(1);
  bad.guess_radius_m = -1.0;
  EXPECT_EQ(Words(db(0).posegraph().Localize({}, kShared, bad).status()),
            Words(db(1).posegraph().Localize({}, kShared, bad).status()));
  // A scan that is gone is no place.
  STRATA_ASSERT_OK(db(0).scans().Delete({}, kShared, {"run", 4}));
  STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeResult gone,
                              LocalizeAt(*servers_[0], *servers_[1], TakenIn(4)));
  EXPECT_FALSE(gone.found);
  STRATA_EXPECT_OK(db(1).posegraph().Localize({}, kShared, TakenIn(3)));
  // What is kept is not read again: it is spoilt behind the server's back.
  STRATA_ASSERT_OK_AND_ASSIGN(const std::unique_ptr<Connection> connection,
                              Connection::Open(store_));
  STRATA_ASSERT_OK(connection->Execute("UPDATE derived_scan_view SET place = '', planes = ''"));
  STRATA_ASSERT_OK(connection->Execute("UPDATE truth_chunk SET bytes = ''"));
  const absl::Time begun = absl::Now();
  STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeResult kept,
                              db(1).posegraph().Localize({}, kShared, TakenIn(3)));
  std::printf("localized by what is kept in %s\n",
              absl::FormatDuration(absl::Now() - begun).c_str());
  EXPECT_TRUE(kept.found) << kept.message;
}

// A robot that goes on where it is followed by a server that has not got the map, also through the
// death of the one that has it and once this one has it.
TEST_F(PlansElsewhereTest, ARobotIsFollowedThroughTheDeathOfTheOwner) {
  for (std::uint64_t hall = 1; hall <= 2; ++hall) STRATA_ASSERT_OK(PutHall(db(0), hall, Corner()));
  STRATA_ASSERT_OK(AtRest(db(0), kShared));
  TrackStart start;
  start.T_map_scan_guess = TakenIn(1).T_map_scan_guess;
  start.guess_radius_m = 2.0;
  const auto owners = db(0).posegraph().Track({}, kShared, start);
  STRATA_ASSERT_OK(owners);
  const auto others = db(1).posegraph().Track({}, kShared, start);
  STRATA_ASSERT_OK(others);
  // From the middle of the corner to a metre before it, by what it would see.
  for (int step = 0; step < 20; ++step) {
    const double x_m = 0.05 * step;
    TrackStep now;
    now.cloud = Corner();
    for (Eigen::Vector3f& point : now.cloud.points) point.x() -= static_cast<float>(x_m);
    now.T_odom_scan = Pose::Identity();
    now.T_odom_scan.translation().x() = x_m;
    const auto told = (*others)->Step(now);
    STRATA_ASSERT_OK(told);
    EXPECT_EQ(told->state, TrackState::kTracked) << step << ": " << told->message;
    EXPECT_NEAR(told->T_map_scan.translation().x(), x_m, 0.1) << step;
    if (step < 10) {
      const auto same = (*owners)->Step(now);
      STRATA_ASSERT_OK(same);
      EXPECT_EQ(BytesOf(*told), BytesOf(*same)) << step;
    }
    if (step == 10) servers_[0]->Kill();
    // This server takes the map over.
    if (step == 15) {
      STRATA_ASSERT_OK(Insist([&] { return AskTheOwner(db(1), kShared); }));
    }
  }
}

// A map that was removed and made again is another one, of the same name and maybe versions.
TEST_F(PlansElsewhereTest, KnowAMapOfTheSameNameFromTheOneBefore) {
  PutHalls(2);
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult two,
                              db(1).planning().PlanPath({}, kShared, FromTo(-6.0, 20.0)));
  EXPECT_TRUE(two.found()) << two.message;
  STRATA_ASSERT_OK(db(0).maps().Delete({}, kShared));
  EXPECT_TRUE(
      absl::IsNotFound(db(1).planning().PlanPath({}, kShared, FromTo(-6.0, 20.0)).status()));
  STRATA_ASSERT_OK(db(0).maps().Create({}, kShared, MapParameters()));
  PutHalls(1);
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanResult one,
                              db(1).planning().PlanPath({}, kShared, FromTo(-6.0, 20.0)));
  EXPECT_EQ(one.reason, PlanReason::kGoalNotOnSurface);
}

// Asked at one server and then the other, in whatever order, while halls are added: a way that was
// there stays, and so does the state that answers are of.
TEST_F(PlansElsewhereTest, NobodyPlansInAnOlderMapThanHeHasSeen) {
  PutHalls(1);
  constexpr std::uint64_t kHalls = 6;
  std::atomic<bool> stop = false;
  std::thread robot([&] {
    for (std::uint64_t number = 2; number <= kHalls; ++number) {
      STRATA_EXPECT_OK(PutHall(*servers_[number % 2]->db(), number));
      absl::SleepFor(absl::Milliseconds(300));
    }
    STRATA_EXPECT_OK(AtRest(*servers_[1]->db(), kShared));
    stop = true;
  });
  std::uint64_t seen = 0;  // halls
  for (std::size_t i = 0; !stop; ++i) {
    std::vector<Eigen::Vector2d> places;
    for (std::uint64_t hall = 0; hall < kHalls; ++hall) {
      places.emplace_back(15.0 * static_cast<double>(hall), -4.0);
    }
    const auto columns = servers_[i % 2]->db()->planning().SampleSurfaces({}, kShared, places);
    STRATA_ASSERT_OK(columns);
    std::uint64_t halls = 0;
    while (halls < kHalls && !(*columns)[halls].surfaces.empty()) ++halls;
    ASSERT_GE(halls, seen) << "server " << i % 2;
    seen = halls;
    const double end_m = 15.0 * static_cast<double>(seen - 1);
    const auto plan =
        servers_[(i + 1) % 2]->db()->planning().PlanPath({}, kShared, FromTo(-6.0, end_m));
    STRATA_ASSERT_OK(plan);
    ASSERT_TRUE(plan->found()) << "server " << (i + 1) % 2 << ", " << seen
                               << " halls: " << plan->message;
  }
  robot.join();
  EXPECT_GT(seen, 2U);
}

}  // namespace
}  // namespace strata::testing
