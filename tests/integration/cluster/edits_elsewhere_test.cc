// Edits of a map at a server that has not got it: made once, true at both servers at once, also
// where the one that has the map dies, freezes or is asked as well.
#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
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
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "core/storage/postgresql/connection.h"
#include "tests/integration/cluster/sharing_servers.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

constexpr std::uint64_t kScans = 4;

ScanId Numbered(std::uint64_t sequence) { return {"run", sequence}; }

Pose Along(double x_m) {
  Pose pose = Pose::Identity();
  pose.translation().x() = x_m;
  return pose;
}

absl::Status SetX(api::Database& db,
                  std::uint64_t sequence,
                  double x_m,
                  absl::Duration patience = kPatience) {
  api::Call call;
  call.stop = Stop(SteadyNow() + patience);
  return db.posegraph().SetPose(call, kShared, Numbered(sequence), Along(x_m));
}

absl::StatusOr<double> XOf(api::Database& db, std::uint64_t sequence) {
  STRATA_ASSIGN_OR_RETURN(const api::PoseLookup found,
                          db.posegraph().LookupPose({}, kShared, Numbered(sequence)));
  return found.T_map_scan.translation().x();
}

// Without the number of the call.
std::string WordsOf(const absl::Status& status) {
  return status.ToString(absl::StatusToStringMode::kWithNoExtraData);
}

double MedianMs(std::vector<double>& all) {
  std::nth_element(
      all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
  return all[all.size() / 2];
}

class EditsElsewhereTest : public SharingServersTest {
 protected:
  void SetUp() override {
    SharingServersTest::SetUp();
    if (IsSkipped()) return;
    for (std::uint64_t scan = 1; scan <= kScans; ++scan) {
      STRATA_ASSERT_OK(PutNumbered(db(0), kShared, scan));
    }
    STRATA_ASSERT_OK(AtRest(db(0), kShared));
  }
  // As each server says.
  void ExpectAtBoth(const std::function<void(api::Database&)>& expect) {
    for (const std::size_t server : {1U, 0U}) {
      SCOPED_TRACE(absl::StrCat("server ", server));
      expect(db(server));
    }
  }
  std::size_t Epochs(std::size_t server) { return db(server).maps().History({}, kShared)->size(); }
  // Of requests that nobody has taken away.
  std::int64_t EditsLeft() {
    const auto connection = Connection::Open(store_);
    if (!connection.ok()) return -1;
    auto row = (*connection)->Query("SELECT count(*) FROM map_edit");
    return row.ok() && row->Next() ? row->Int(0) : -1;
  }
};

TEST_F(EditsElsewhereTest, OfThePoseGraphAreTrueAtBothServersAtOnce) {
  for (const std::size_t server : {1U, 0U}) {
    SCOPED_TRACE(absl::StrCat("asked ", server));
    Constraint loop;
    loop.i = Numbered(1);
    loop.j = Numbered(2);
    STRATA_ASSERT_OK_AND_ASSIGN(const Constraint added,
                                db(server).posegraph().AddConstraint({}, kShared, loop));
    const auto find = [&](api::Database& there) -> std::optional<Constraint> {
      const auto graph = there.posegraph().Get({}, kShared);
      STRATA_EXPECT_OK(graph);
      for (const Constraint& one : graph->constraints) {
        if (one.id == added.id) return one;
      }
      return std::nullopt;
    };
    ExpectAtBoth([&](api::Database& there) { EXPECT_TRUE(find(there)->enabled); });
    STRATA_ASSERT_OK(
        db(server).posegraph().EnableConstraint({}, kShared, added.id, /*enabled=*/false));
    ExpectAtBoth([&](api::Database& there) { EXPECT_FALSE(find(there)->enabled); });
    STRATA_ASSERT_OK(db(server).posegraph().RemoveConstraint({}, kShared, added.id));
    ExpectAtBoth([&](api::Database& there) { EXPECT_FALSE(find(there).has_value()); });
    const double x = 0.25 + static_cast<double>(server);
    STRATA_ASSERT_OK(SetX(db(server), 1, x));
    ExpectAtBoth([&](api::Database& there) { EXPECT_NEAR(*XOf(there, 1), x, 1e-9); });
  }
  EXPECT_EQ(Epochs(0), 3U);
  EXPECT_EQ(MapOwnerOf(AskTheOwner(db(1), kShared)), "a") << "who has it all the time";
  EXPECT_EQ(EditsLeft(), 0);
}

TEST_F(EditsElsewhereTest, OfScansAndSettingsAreTrueAtBothServersAtOnce) {
  for (const std::size_t server : {1U, 0U}) {
    SCOPED_TRACE(absl::StrCat("asked ", server));
    const auto at = static_cast<std::uint16_t>(server + 1);
    const std::vector<std::uint16_t> labels(kNumberedPoints, at);
    STRATA_ASSERT_OK(
        db(server).scans().SetLabels({}, kShared, Numbered(at), labels, api::LabelMode::kReplace));
    const MapClass map_class = {at, absl::StrCat("class", at), 7};
    STRATA_ASSERT_OK(db(server).maps().SetClass({}, kShared, map_class));
    const GeodeticOrigin origin = {0.1 * at, 0.2, 300.0};
    STRATA_ASSERT_OK(db(server).maps().SetOrigin({}, kShared, origin));
    RobotProfile robot;
    robot.radius_m = 0.1 * at;
    STRATA_ASSERT_OK(db(server).planning().SetProfile({}, kShared, "small", robot));
    STRATA_ASSERT_OK(db(server).planning().SetProfile({}, kShared, "default", robot));
    STRATA_ASSERT_OK(db(server).scans().Delete({}, kShared, Numbered(kScans - server)));
    ExpectAtBoth([&](api::Database& there) {
      EXPECT_TRUE(there.scans().Get({}, kShared, Numbered(at))->person_labels);
      STRATA_EXPECT_OK(there.scans().GetPoints({}, kShared, Numbered(at), [&](const auto& piece) {
        EXPECT_EQ(piece.label, labels);
        return absl::OkStatus();
      }));
      EXPECT_THAT(*there.maps().ListClasses({}, kShared), ::testing::Contains(map_class));
      EXPECT_EQ(there.maps().Get({}, kShared)->parameters.origin, origin);
      EXPECT_EQ(there.maps().Get({}, kShared)->parameters.default_profile, robot);
      EXPECT_EQ(there.planning().ListProfiles({}, kShared)->at("small"), robot);
      EXPECT_TRUE(
          absl::IsNotFound(there.scans().Get({}, kShared, Numbered(kScans - server)).status()));
    });
    // A list says so a little later.
    STRATA_EXPECT_OK(Insist([&]() -> absl::Status {
      for (const auto& one : servers_) {
        const auto maps = one->db()->maps().List({});
        if (!maps.ok()) return maps.status();
        if (maps->front().parameters.origin != origin) return absl::UnavailableError("not yet");
      }
      return absl::OkStatus();
    }));
  }
  EXPECT_EQ(MapOwnerOf(AskTheOwner(db(1), kShared)), "a");
  EXPECT_EQ(EditsLeft(), 0);
}

TEST_F(EditsElsewhereTest, AreRefusedWithTheOwnersWords) {
  const std::vector<std::function<absl::Status(api::Database&)>> edits = {
      [](api::Database& there) { return SetX(there, 99, 1.0); },
      [](api::Database& there) { return SetX(there, 1, 1e300); },
      [](api::Database& there) { return there.scans().Delete({}, kShared, Numbered(99)); },
      [](api::Database& there) {
        return there.scans().Delete({}, kShared, {"", 1});
      },
      [](api::Database& there) { return there.scans().Delete({}, "nowhere", Numbered(1)); },
      [](api::Database& there) {
        return there.scans().SetLabels({}, kShared, Numbered(1), {1, 2}, api::LabelMode::kReplace);
      },
      [](api::Database& there) { return there.posegraph().RemoveConstraint({}, kShared, 77); },
      [](api::Database& there) {
        return there.planning().SetProfile({}, kShared, "default", {.radius_m = -1.0});
      },
      [](api::Database& there) {
        return there.classifiers().Import({}, "nowhere", "a", "no bytes").status();
      },
      [](api::Database& there) { return there.objects().ImportKind({}, "nowhere", {}).status(); },
      [](api::Database& there) { return there.objects().DeleteKind({}, kShared, "nobody"); },
      [](api::Database& there) { return there.classifiers().Delete({}, kShared, "nobody"); },
  };
  for (std::size_t i = 0; i < edits.size(); ++i) {
    const absl::Status owners = edits[i](db(0));
    EXPECT_FALSE(owners.ok()) << i;
    EXPECT_EQ(WordsOf(owners), WordsOf(edits[i](db(1)))) << i;
  }
  EXPECT_EQ(Epochs(0), 1U);
  for (const std::size_t server : {0U, 1U}) {  // whatever else is wrong
    EXPECT_TRUE(
        absl::IsNotFound(db(server).classifiers().Import({}, "nowhere", "a", "no bytes").status()));
  }
}

// One whose asker has died is not made after what was asked for later.
TEST_F(EditsElsewhereTest, ThatWaitAreMadeBeforeWhatTheOwnerIsAskedForThen) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto connection, Connection::Open(store_));
  STRATA_ASSERT_OK(
      connection->Execute("INSERT INTO map_edit (map, kind, trajectory, sequence, value) SELECT "
                          "map, 2, 'run', 4, '' FROM truth_map"));
  EXPECT_TRUE(absl::IsNotFound(SetX(db(0), 4, 1.0)));
}

// It is made by whoever takes the map over, once.
TEST_F(EditsElsewhereTest, OutliveTheOneWhoHasTheMap) {
  servers_[0]->Signal(SIGSTOP);
  std::thread person([&] { STRATA_EXPECT_OK(SetX(*servers_[1]->db(), 1, 5.0)); });
  absl::SleepFor(absl::Milliseconds(300));
  servers_[0]->Kill();
  person.join();
  EXPECT_NEAR(*XOf(db(1), 1), 5.0, 1e-9);
  EXPECT_EQ(Epochs(1), 2U);
  STRATA_EXPECT_OK(AskTheOwner(db(1), kShared));
}

// Or by the one that was asked, where nobody has it any more.
TEST_F(EditsElsewhereTest, AreMadeWhereTheyAreAskedForOnceNobodyHasTheMap) {
  servers_[0]->Signal(SIGSTOP);
  std::thread person([&] { STRATA_EXPECT_OK(SetX(*servers_[1]->db(), 1, 5.0)); });
  STRATA_EXPECT_OK(Insist(
      [&] { return EditsLeft() == 1 ? absl::OkStatus() : absl::UnavailableError("not asked"); }));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto connection, Connection::Open(store_));
  STRATA_EXPECT_OK(connection->Execute("DELETE FROM map_lease"));  // as who gives it up does
  person.join();
  EXPECT_NEAR(*XOf(db(1), 1), 5.0, 1e-9);
  EXPECT_EQ(Epochs(1), 2U);
  servers_[0]->Signal(SIGCONT);
  STRATA_EXPECT_OK(Insist([&] { return SetX(*servers_[0]->db(), 1, 6.0); }));
  EXPECT_EQ(Epochs(1), 3U);
}

// The one who was asked takes the edit back, while the one who has the map can not make it.
TEST_F(EditsElsewhereTest, WhoGivesUpHasChangedNothing) {
  servers_[0]->Signal(SIGSTOP);
  const absl::Status told = SetX(db(1), 1, 5.0, absl::Milliseconds(200));
  EXPECT_TRUE(absl::IsDeadlineExceeded(told)) << told;
  STRATA_EXPECT_OK(
      Insist([&] { return EditsLeft() == 0 ? absl::OkStatus() : absl::UnavailableError("left"); }));
  const bool taken_over = AskTheOwner(db(1), kShared).ok();  // on a machine that is too busy
  servers_[0]->Signal(SIGCONT);
  STRATA_EXPECT_OK(Insist([&] { return SetX(*servers_[0]->db(), 2, 6.0); }));
  STRATA_EXPECT_OK(SetX(db(1), 3, 7.0));
  const bool made = taken_over && *XOf(db(1), 1) == 5.0;
  EXPECT_NEAR(*XOf(db(1), 1), made ? 5.0 : 0.0, 1e-9);
  EXPECT_EQ(Epochs(1), made ? 4U : 3U);
}

TEST_F(EditsElsewhereTest, TakeLongerWhereTheWorkerMakesThem) {
  std::array<std::vector<double>, 2> poses, constraints;
  Constraint loop;
  loop.i = Numbered(1);
  loop.j = Numbered(2);
  for (int i = 0; i < 7; ++i) {
    for (const std::size_t server : {0U, 1U}) {
      const absl::Time begun = SteadyNow();
      STRATA_EXPECT_OK(SetX(db(server), 1, 0.1 * i));
      const absl::Time moved = SteadyNow();
      for (int k = 0; k < 20; ++k) {
        const absl::Time before = SteadyNow();
        STRATA_EXPECT_OK(db(server).posegraph().AddConstraint({}, kShared, loop));
        constraints[server].push_back(absl::ToDoubleMilliseconds(SteadyNow() - before));
      }
      poses[server].push_back(absl::ToDoubleMilliseconds(moved - begun));
    }
  }
  const double first = poses[1].front();
  std::printf(
      "a constraint %.2f ms elsewhere, %.2f ms at the owner; a pose %.0f ms (the first %.0f) "
      "and %.0f ms\n",
      MedianMs(constraints[1]),
      MedianMs(constraints[0]),
      MedianMs(poses[1]),
      first,
      MedianMs(poses[0]));
}

// Eight who ask elsewhere without end, and one who asks the owner.
TEST_F(EditsElsewhereTest, LeaveTheOwnerTimeForThoseWhoAskIt) {
  std::atomic<bool> over = false;
  std::atomic<int> elsewhere = 0;
  std::vector<std::thread> people;
  for (std::uint64_t person = 0; person < 8; ++person) {
    people.emplace_back([&, person] {
      for (int i = 1; !over; ++i) {
        STRATA_EXPECT_OK(SetX(*servers_[1]->db(), 1 + person % kScans, 0.1 * i));
        ++elsewhere;
      }
    });
  }
  std::vector<double> took_ms;
  for (int i = 0; i < 20; ++i) {
    const absl::Time begun = SteadyNow();
    STRATA_EXPECT_OK(SetX(db(0), 1, 0.1 * i));
    took_ms.push_back(absl::ToDoubleMilliseconds(SteadyNow() - begun));
    absl::SleepFor(absl::Milliseconds(150));
  }
  over = true;
  for (std::thread& person : people) person.join();
  std::printf("the owner's caller waited %.0f ms (p50), %.0f ms at most, beside %d elsewhere\n",
              MedianMs(took_ms),
              *std::max_element(took_ms.begin(), took_ms.end()),
              elsewhere.load());
  EXPECT_EQ(Epochs(0), 21U + static_cast<std::size_t>(elsewhere));
}

// Nothing that was acknowledged is lost, nothing is made twice, and nobody sees an older state than
// he was told of, while the servers are killed by turns.
TEST_F(EditsElsewhereTest, SurviveKillsOfBothServers) {
  std::atomic<bool> stop = false;
  std::atomic<std::size_t> told = 0, in_doubt = 0;
  std::vector<std::thread> people;
  for (std::uint64_t person = 0; person < 3; ++person) {
    people.emplace_back([&, person] {
      const std::uint64_t mine = 1 + person;
      double last = 0.0;
      for (std::size_t i = 1; !stop; ++i) {
        const absl::Status set = SetX(
            *servers_[(person + i) % 2]->db(), mine, static_cast<double>(i), absl::Seconds(10));
        ++(set.ok() ? told : in_doubt);
        if (set.ok()) last = static_cast<double>(i);
        if (!set.ok()) absl::SleepFor(absl::Milliseconds(50));
        for (const auto& server : servers_) {
          const absl::StatusOr<double> seen = XOf(*server->db(), mine);
          EXPECT_GE(seen.value_or(last), last - 1e-9) << "of " << mine;
        }
      }
    });
  }
  for (std::size_t kill = 0; kill < 4; ++kill) {
    const std::size_t before = told;
    const absl::Time end = absl::Now() + kPatience;
    while (told < before + 5 && absl::Now() < end) absl::SleepFor(absl::Milliseconds(5));
    EXPECT_GE(told, before + 5) << "nobody took over";
    servers_[kill % 2]->Kill();
    absl::SleepFor(absl::Milliseconds(1500));
    servers_[kill % 2]->Start();
  }
  stop = true;
  for (std::thread& person : people) person.join();
  std::printf("%zu told, %zu in doubt\n", told.load(), in_doubt.load());
  // Those in doubt may have been made.
  EXPECT_GE(Epochs(1), 1 + std::min<std::size_t>(told, 31));  // so many are kept
}

}  // namespace
}  // namespace strata::testing
