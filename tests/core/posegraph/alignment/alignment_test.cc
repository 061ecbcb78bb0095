#include "core/posegraph/alignment/alignment.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/posegraph/information.h"
#include "tests/core/posegraph/alignment/alignment_world.h"
#include "tests/core/posegraph/random_poses.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::_;
using testing::AlignmentTest;
using ::testing::Each;
using testing::Errors;
using ::testing::Gt;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::RandomPoses;
using testing::StatusIs;
using testing::YardScans;
using Code = absl::StatusCode;

TEST_F(AlignmentTest, DisturbedPosesComeBack) {
  for (const std::uint64_t seed : {1, 2}) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    problem_.T_map_scan = yard().truth();
    Disturb(seed);
    ASSERT_GT(ErrorsOf(problem_.T_map_scan).max_m, 0.15);
    STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
    const Errors errors = ErrorsOf(result.T_map_scan);
    RecordProperty("max_mm", static_cast<int>(1000 * errors.max_m));
    EXPECT_LT(errors.max_m, 0.02);
    EXPECT_LT(errors.max_rad, 0.002);
    EXPECT_TRUE(result.T_map_scan[0].isApprox(yard().truth()[0], 1e-9));  // the gauge
    EXPECT_THAT(result.planes, Not(IsEmpty()));
    EXPECT_THAT(result.rejected, IsEmpty());
    for (const RelativePoseTerm& term : result.measured) {
      const Pose off = TrueStep(term.i, term.j).inverse() * term.T_i_j;
      EXPECT_LT(off.translation().norm(), 0.05) << term.i << " " << term.j;
    }
    EXPECT_LT(result.rounds.back().max_shift_m, result.rounds.front().max_shift_m);
  }
}

// In UTM moments about the map's zero lost what they were about: poses did not settle, and planes
// that nobody wants were used.
TEST_F(AlignmentTest, MapsMayLieFarAway) {
  Disturb(1);
  const Eigen::Vector3d away(4e5 + 12.8, -5e6 + 3.2, 100.0);
  const auto align_far = [&]() -> absl::StatusOr<AlignmentResult> {
    const AlignmentProblem near = problem_;
    for (Pose& pose : problem_.T_map_scan) pose.translation() += away;
    for (ExcludedPlane& excluded : problem_.excluded_planes) {
      excluded.plane_map.distance += excluded.plane_map.normal.dot(away);
    }
    absl::StatusOr<AlignmentResult> result = Align();
    problem_ = near;
    return result;
  };
  const auto expect_alike = [&](const AlignmentResult& near, const AlignmentResult& far) {
    EXPECT_EQ(far.termination, near.termination);
    for (std::size_t k = 0; k < YardScans::kScans; ++k) {
      const Eigen::Vector3d back = far.T_map_scan[k].translation() - away;
      EXPECT_LT((back - near.T_map_scan[k].translation()).norm(), 1e-3) << k;
    }
    ASSERT_EQ(far.planes.size(), near.planes.size());
    for (std::size_t k = 0; k < near.planes.size(); ++k) {
      const Plane& plane = far.planes[k].plane;
      EXPECT_NEAR(plane.distance - plane.normal.dot(away), near.planes[k].plane.distance, 1e-3);
    }
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult near, Align());
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult far, align_far());
  expect_alike(near, far);
  ExcludedPlane unwanted{near.planes[0].plane, {}};
  for (const SharedPlane::View& view : near.planes[0].views) unwanted.nodes.push_back(view.scan);
  problem_.excluded_planes.push_back(unwanted);
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult near_without, Align());
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult far_without, align_far());
  expect_alike(near_without, far_without);
}

TEST_F(AlignmentTest, WhereNothingMovesCorrespondencesAreKept) {
  options_.settled_m = 0.002;
  options_.settled_rad = 0.0002;
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  EXPECT_EQ(result.rounds.front().registered, result.rounds.front().matches);
  EXPECT_LT(result.rounds.back().registered, result.rounds.front().registered / 2);
  EXPECT_LT(ErrorsOf(result.T_map_scan).max_m, 0.02);
}

// Counts how often planes are asked for.
class CountedPlanes final : public AlignmentSource {
 public:
  explicit CountedPlanes(AlignmentSource& source) : source_(source) {}
  absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t node) override {
    return source_.Features(node);
  }
  absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t node) override {
    ++count;
    return source_.Planes(node);
  }
  std::size_t count = 0;

 private:
  AlignmentSource& source_;
};

TEST_F(AlignmentTest, PlanesAreKeptOncePosesAreNearlyRight) {
  options_.settled_m = 0.0;
  options_.settled_rad = 0.0;
  CountedPlanes source(yard());
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(source));
  ASSERT_GT(result.rounds.size(), 1U);
  EXPECT_EQ(source.count, std::size_t{YardScans::kScans});
  EXPECT_EQ(result.rounds.back().planes, result.rounds.front().planes);
}

TEST_F(AlignmentTest, WhatWideGatesFoundIsSortedOutOncePosesHaveSettled) {
  options_.max_rounds = 10;
  CountedPlanes source(yard());
  options_.shared_planes.pose_sigma_m *= 10.0;
  options_.shared_planes.pose_sigma_rad *= 10.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(source));
  EXPECT_EQ(result.termination, AlignmentTermination::kSettled);
  EXPECT_EQ(source.count, std::size_t{2 * YardScans::kScans}) << "once wide, once narrow";
}

TEST_F(AlignmentTest, PlanesDoNoHarm) {
  for (const std::uint64_t seed : {1, 2}) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    problem_.T_map_scan = yard().truth();
    Disturb(seed);
    options_.planes = true;
    STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult with, Align());
    options_.planes = false;
    STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult without, Align());
    EXPECT_THAT(without.planes, IsEmpty());
    EXPECT_EQ(without.rounds.back().supports, 0U);
    EXPECT_LT(ErrorsOf(with.T_map_scan).mean_m, ErrorsOf(without.T_map_scan).mean_m + 0.002);
  }
}

TEST_F(AlignmentTest, PlanesAreThoseOfTheYard) {
  Disturb(3);
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  bool ground = false;
  bool south_wall = false;
  for (const SharedPlane& plane : result.planes) {
    const Plane& found = plane.plane;
    ground |= found.normal.z() > 0.9999 && std::abs(found.distance) < 0.02;
    south_wall |= found.normal.y() > 0.9999 && std::abs(found.distance + 14.0) < 0.03;
    EXPECT_GE(plane.views.size(), 2U);
  }
  EXPECT_TRUE(ground);
  EXPECT_TRUE(south_wall);
}

TEST_F(AlignmentTest, AnExcludedPlaneIsNotUsed) {
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult all, Align());
  ASSERT_THAT(all.planes, Not(IsEmpty()));
  const SharedPlane& first = all.planes.front();
  const auto same = [&first](const SharedPlane& plane) {
    return plane.plane.normal.dot(first.plane.normal) > 0.999 &&
           std::abs(plane.plane.distance - first.plane.distance) < 0.1;
  };
  ASSERT_EQ(std::count_if(all.planes.begin(), all.planes.end(), same), 1);
  problem_.excluded_planes = {{first.plane, {first.views.front().scan}}};
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult without, Align());
  EXPECT_EQ(std::count_if(without.planes.begin(), without.planes.end(), same), 0);
  EXPECT_THAT(without.planes, Not(IsEmpty()));
  EXPECT_EQ(without.rounds.back().planes, without.planes.size());
  // Where no scan supports it, it is another one.
  problem_.excluded_planes[0].nodes.clear();
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult others, Align());
  EXPECT_EQ(others.planes.size(), all.planes.size());
}

TEST_F(AlignmentTest, WhatWasMeasuredAtIngestStaysInForce) {
  Matrix6d sure = 1e6 * Matrix6d::Identity();
  RandomPoses random(5);
  for (ScanPair& pair : problem_.pairs) {
    pair.measured =
        MeasuredPose{Retract(TrueStep(pair.i, pair.j), random.Step(0.0005, 0.005)), sure};
  }
  Disturb(5, 0.003, 0.02);
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  for (const ScanPair& pair : problem_.pairs) {
    const auto same = [&pair](const RelativePoseTerm& term) {
      return term.i == pair.i && term.j == pair.j &&
             term.T_i_j.isApprox(pair.measured->T_i_j, 1e-12);
    };
    EXPECT_EQ(std::count_if(result.measured.begin(), result.measured.end(), same), 1)
        << pair.i << " " << pair.j;
  }
  // Nothing of a robot's own way is measured again.
  const std::size_t own = std::count_if(
      result.measured.begin(), result.measured.end(), [](const RelativePoseTerm& term) {
        return (term.i < YardScans::kFirst) == (term.j < YardScans::kFirst);
      });
  EXPECT_EQ(own, problem_.pairs.size());
  EXPECT_LT(ErrorsOf(result.T_map_scan).max_m, 0.03);
}

TEST_F(AlignmentTest, WhatThePosesContradictIsMeasuredAgain) {
  for (ScanPair& pair : problem_.pairs) {
    Pose wrong = TrueStep(pair.i, pair.j);
    if (pair.j == 3) wrong.translation().x() += 0.5;
    pair.measured = MeasuredPose{wrong, 1e6 * Matrix6d::Identity()};
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  for (const RelativePoseTerm& term : result.measured) {
    EXPECT_LT((TrueStep(term.i, term.j).inverse() * term.T_i_j).translation().norm(), 0.1);
  }
  const bool again =
      std::any_of(result.measured.begin(), result.measured.end(), [](const RelativePoseTerm& term) {
        return term.j == 3 && term.i < 3;
      });
  EXPECT_TRUE(again);
  EXPECT_LT(ErrorsOf(result.T_map_scan).max_m, 0.02);
}

TEST_F(AlignmentTest, AFalseClosureMovesNothingUnlessItMustBeTrue) {
  RelativePoseTerm lie{1, 8, TrueStep(1, 8), 1e6 * Matrix6d::Identity(), true};
  lie.T_i_j.translation().y() += 3.0;
  problem_.relative = {lie};
  Disturb(6);
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  EXPECT_LT(ErrorsOf(result.T_map_scan).max_m, 0.02);
  ASSERT_FALSE(result.rejected.empty());
  EXPECT_TRUE(result.rejected[0].given);
  EXPECT_EQ(result.rejected[0].term.j, 8U);
  EXPECT_GT(result.rejected[0].chi2, 1e5);
  for (std::size_t k = 1; k < result.rejected.size(); ++k) {
    EXPECT_FALSE(result.rejected[k].given);
  }
  for (const RelativePoseTerm& term : result.measured) {
    EXPECT_FALSE(term.T_i_j.isApprox(lie.T_i_j));  // it was given
  }
  problem_.relative[0].may_be_false = false;
  options_.max_rounds = 1;
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult believed, Align());
  EXPECT_GT(ErrorsOf(believed.T_map_scan).max_m, 0.5);
}

TEST_F(AlignmentTest, ExcludedPairsAreNotMeasured) {
  for (std::size_t i = 0; i < YardScans::kFirst; ++i) {
    for (std::size_t j = YardScans::kFirst; j < YardScans::kScans; ++j) {
      problem_.excluded_pairs.emplace_back(j, i);
    }
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  for (const RelativePoseTerm& term : result.measured) {
    EXPECT_EQ(term.i < YardScans::kFirst, term.j < YardScans::kFirst) << term.i << " " << term.j;
  }
  EXPECT_THAT(result.parts, Each(0U));  // they are said to be in one frame
}

TEST_F(AlignmentTest, RobotsThatNothingJoinsAreNotMatchedAndStayWhereTheyAre) {
  problem_.relative.clear();
  for (std::size_t k = 0; k < YardScans::kFirst; ++k) {
    problem_.T_map_scan[k].translation().x() += 0.3;
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align());
  for (const std::size_t first : {std::size_t{0}, YardScans::kFirst}) {
    EXPECT_TRUE(result.T_map_scan[first].isApprox(problem_.T_map_scan[first], 1e-12)) << first;
  }
  ASSERT_EQ(result.parts.size(), std::size_t{YardScans::kScans});
  for (std::size_t k = 0; k < YardScans::kScans; ++k) {
    EXPECT_EQ(result.parts[k], k < YardScans::kFirst ? 0U : YardScans::kFirst) << k;
  }
}

TEST_F(AlignmentTest, TheResultDoesNotDependOnTheOrderOfWork) {
  Disturb(7);
  options_.max_rounds = 2;
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult forward, Align());
  const auto backward = [](std::size_t count,
                           absl::FunctionRef<absl::Status(std::size_t)> body) -> absl::Status {
    absl::Status status;
    for (std::size_t k = count; k > 0; --k) status.Update(body(k - 1));
    return status;
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(yard(), backward));
  ASSERT_EQ(result.T_map_scan.size(), forward.T_map_scan.size());
  for (std::size_t k = 0; k < result.T_map_scan.size(); ++k) {
    EXPECT_EQ(result.T_map_scan[k].matrix(), forward.T_map_scan[k].matrix()) << k;
  }
  EXPECT_EQ(result.measured.size(), forward.measured.size());
  EXPECT_EQ(result.planes.size(), forward.planes.size());
}

TEST_F(AlignmentTest, FixedScansStayAndPriorsMoveTheWorld) {
  const Pose shift = MakePose(Eigen::Quaterniond::Identity(), {0.3, 0.0, 0.0});
  for (const std::size_t node : {0, 5, 9}) {
    problem_.priors.push_back({node, shift * yard().truth()[node], 1e8 * Matrix6d::Identity()});
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult moved, Align());
  for (std::size_t k = 0; k < YardScans::kScans; ++k) {
    const Pose expected = shift * yard().truth()[k];
    EXPECT_LT((moved.T_map_scan[k].translation() - expected.translation()).norm(), 0.03) << k;
  }
  problem_.fixed.assign(YardScans::kScans, true);
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult held, Align());
  for (std::size_t k = 0; k < YardScans::kScans; ++k) {
    EXPECT_TRUE(held.T_map_scan[k].isApprox(yard().truth()[k], 1e-12)) << k;
  }
  EXPECT_EQ(held.termination, AlignmentTermination::kSettled);
  EXPECT_EQ(held.rounds.size(), 1U);
}

// One scan's features or planes cannot be had.
class SpoiltSource final : public AlignmentSource {
 public:
  SpoiltSource(AlignmentSource& whole, std::size_t node, absl::Status error)
      : whole_(whole), node_(node), error_(std::move(error)) {}
  absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t node) override {
    if (node == node_) return error_;
    return whole_.Features(node);
  }
  absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t node) override {
    if (node == node_) return error_;
    return whole_.Planes(node);
  }

 private:
  AlignmentSource& whole_;
  const std::size_t node_;
  const absl::Status error_;
};

TEST_F(AlignmentTest, ADamagedScanKeepsItsPlaceOnItsWayAndHarmsNoOther) {
  SpoiltSource spoilt(yard(), 3, absl::DataLossError("points of scan 3"));
  Disturb(8);
  STRATA_ASSERT_OK_AND_ASSIGN(const AlignmentResult result, Align(spoilt));
  for (const RelativePoseTerm& term : result.measured) {
    if (term.i != 3 && term.j != 3) continue;
    EXPECT_EQ(term.i, 2U);  // what its odometry says; the one after is held by others
    EXPECT_EQ(term.j, 3U);
  }
  const Pose step = problem_.T_map_scan[2].inverse() * problem_.T_map_scan[3];
  EXPECT_TRUE((result.T_map_scan[2].inverse() * result.T_map_scan[3]).isApprox(step, 1e-6));
  for (std::size_t k = 1; k < YardScans::kScans; ++k) {
    if (k == 3) continue;
    const Pose off = yard().truth()[k].inverse() * result.T_map_scan[k];
    EXPECT_LT(off.translation().norm(), 0.02) << k;
  }
}

TEST_F(AlignmentTest, ItEndsWithWhatItIsToldToEndWith) {
  SpoiltSource broken(yard(), 3, absl::UnavailableError("no disk"));
  EXPECT_THAT(Align(broken), StatusIs(Code::kUnavailable, HasSubstr("no disk")));
  const Stop stop;
  stop.Request();
  EXPECT_THAT(
      AlignScans(
          problem_, yard(), options_, ForEachInTurn, [](double) { return absl::OkStatus(); }, stop),
      StatusIs(Code::kCancelled, _));
  std::vector<double> told;
  EXPECT_THAT(AlignScans(
                  problem_,
                  yard(),
                  options_,
                  ForEachInTurn,
                  [&told](double progress) {
                    told.push_back(progress);
                    return progress > 0.0 ? absl::AbortedError("enough") : absl::OkStatus();
                  },
                  Stop()),
              StatusIs(Code::kAborted, "enough"));
  EXPECT_THAT(told, ::testing::ElementsAre(0.0, Gt(0.0)));
}

TEST_F(AlignmentTest, BadProblemsAreRefused) {
  const AlignmentProblem good = problem_;
  const auto refused = [this, &good](const char* what) {
    EXPECT_THAT(Align(), StatusIs(Code::kInvalidArgument, HasSubstr(what)));
    problem_ = good;
  };
  problem_.pairs.push_back({2, YardScans::kScans});
  refused("pair");
  problem_.pairs.push_back({2, 2});
  refused("pair");
  problem_.trajectories[0].push_back(YardScans::kScans);
  refused("trajectories");
  problem_.trajectories[1].push_back(0);
  refused("trajectories");
  problem_.trajectories[0].pop_back();
  refused("trajectories");
  problem_.T_map_scan[4].translation().x() = std::numeric_limits<double>::quiet_NaN();
  refused("");
}

TEST(AlignmentOfNothingTest, AnEmptyWorldIsSettled) {
  class Nothing final : public AlignmentSource {
    absl::StatusOr<std::shared_ptr<const ScanFeatures>> Features(std::size_t) override {
      return absl::InternalError("asked");
    }
    absl::StatusOr<std::shared_ptr<const ScanPlanes>> Planes(std::size_t) override {
      return absl::InternalError("asked");
    }
  } nothing;
  STRATA_ASSERT_OK_AND_ASSIGN(
      const AlignmentResult result,
      AlignScans(
          {}, nothing, {}, ForEachInTurn, [](double) { return absl::OkStatus(); }, Stop()));
  EXPECT_THAT(result.T_map_scan, IsEmpty());
  EXPECT_EQ(result.termination, AlignmentTermination::kSettled);
}

}  // namespace
}  // namespace strata
