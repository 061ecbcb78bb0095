#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "strata/v1/jobs.grpc.pb.h"
#include "strata/v1/posegraph.grpc.pb.h"
#include "tests/server/served_mock.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Return;
using Code = absl::StatusCode;

class PoseGraphTest : public ServedMock {
 protected:
  void SetUp() override {
    Serve();
    request_.set_map("campus");
    v1::Constraint& constraint = *request_.mutable_constraint();
    constraint.mutable_i()->set_trajectory("a");
    constraint.mutable_j()->set_trajectory("b");
    for (int i = 0; i < 36; ++i) constraint.add_information(i % 7 == 0 ? 100.0 : 0.0);
  }
  absl::Status Add() {
    return Call<v1::PoseGraph>(&v1::PoseGraph::Stub::AddConstraint, request_, &response_);
  }

  v1::AddConstraintRequest request_;
  v1::AddConstraintResponse response_;
};

TEST_F(PoseGraphTest, AConstraintIsRecordedAsSaid) {
  request_.mutable_constraint()->set_id(99);  // ignored
  EXPECT_CALL(db_.posegraph(), AddConstraint(_, absl::string_view("campus"), _))
      .WillOnce([](auto&, auto, Constraint constraint) {
        EXPECT_EQ(constraint.id, 0U);
        EXPECT_TRUE(constraint.enabled);  // the default of the contract
        EXPECT_FALSE(constraint.is_prior());
        EXPECT_EQ(constraint.information, Matrix6d(Matrix6d::Identity() * 100.0));
        constraint.id = 5;
        return absl::StatusOr<Constraint>(constraint);
      });
  ASSERT_THAT(Add(), IsOk());
  EXPECT_EQ(response_.constraint().id(), 5U);
  EXPECT_EQ(response_.constraint().origin(), v1::CONSTRAINT_ORIGIN_PERSON);
}

TEST_F(PoseGraphTest, WithoutAFirstScanItIsAPrior) {
  request_.mutable_constraint()->clear_i();
  request_.mutable_constraint()->set_enabled(false);
  EXPECT_CALL(db_.posegraph(), AddConstraint(_, _, _))
      .WillOnce([](auto&, auto, const Constraint& constraint) {
        EXPECT_TRUE(constraint.is_prior());
        EXPECT_FALSE(constraint.enabled);
        return absl::StatusOr<Constraint>(constraint);
      });
  ASSERT_THAT(Add(), IsOk());
  EXPECT_FALSE(response_.constraint().has_i());
}

TEST_F(PoseGraphTest, WhatIsNoConstraintNeverReachesTheDatabase) {
  EXPECT_CALL(db_.posegraph(), AddConstraint(_, _, _)).Times(0);
  v1::Constraint& constraint = *request_.mutable_constraint();
  const v1::Constraint good = constraint;
  constraint.set_information(0, -100.0);
  EXPECT_THAT(Add(), StatusIs(Code::kInvalidArgument, HasSubstr("negative eigenvalue")));
  constraint = good;
  constraint.clear_information();
  const absl::Status status = Add();
  EXPECT_THAT(status, StatusIs(Code::kInvalidArgument, HasSubstr("0 numbers")));
  EXPECT_EQ(ReasonOf(status), "REQUEST");
  constraint = good;
  *constraint.mutable_j() = constraint.i();
  EXPECT_THAT(Add(), StatusIs(Code::kInvalidArgument, HasSubstr("held against itself")));
  constraint = good;
  constraint.mutable_j()->set_trajectory("../b");
  EXPECT_THAT(Add(), StatusIs(Code::kInvalidArgument, HasSubstr("'../b'")));
  constraint = good;
  constraint.set_note(std::string(1001, 'x'));
  EXPECT_THAT(Add(), StatusIs(Code::kInvalidArgument, HasSubstr("1001 bytes")));
  request_.clear_constraint();
  EXPECT_THAT(Add(), StatusIs(Code::kInvalidArgument, _));
}

TEST_F(PoseGraphTest, ConstraintsAreSwitchedAndRemovedById) {
  EXPECT_CALL(db_.posegraph(), EnableConstraint(_, absl::string_view("campus"), 7, false))
      .WillOnce(Return(absl::OkStatus()));
  EXPECT_CALL(db_.posegraph(), RemoveConstraint(_, absl::string_view("campus"), 8))
      .WillOnce(Return(absl::NotFoundError("constraint 8")));
  v1::EnableConstraintRequest enable;
  enable.set_map("campus");
  enable.set_id(7);
  v1::EnableConstraintResponse enabled;
  EXPECT_THAT(Call<v1::PoseGraph>(&v1::PoseGraph::Stub::EnableConstraint, enable, &enabled),
              IsOk());
  v1::RemoveConstraintRequest remove;
  remove.set_map("campus");
  remove.set_id(8);
  v1::RemoveConstraintResponse removed;
  EXPECT_THAT(Call<v1::PoseGraph>(&v1::PoseGraph::Stub::RemoveConstraint, remove, &removed),
              StatusIs(Code::kNotFound, "constraint 8"));
}

TEST_F(PoseGraphTest, APoseThatIsNotKnownSaysWhy) {
  EXPECT_CALL(db_.posegraph(), LookupPose(_, _, ScanId{"run", 4}))
      .WillOnce(Return(api::PoseLookup{false,
                                       "pending behind 3 scans",
                                       MakePose(Eigen::Quaterniond::Identity(), {1, 2, 3}),
                                       6}));
  v1::LookupPoseRequest in;
  in.mutable_id()->set_trajectory("run");
  in.mutable_id()->set_sequence(4);
  v1::LookupPoseResponse out;
  ASSERT_THAT(Call<v1::PoseGraph>(&v1::PoseGraph::Stub::LookupPose, in, &out), IsOk());
  EXPECT_FALSE(out.known());
  EXPECT_EQ(out.message(), "pending behind 3 scans");
  EXPECT_EQ(out.pose().translation().y(), 2.0);
  EXPECT_EQ(out.epoch(), 6U);
}

TEST_F(PoseGraphTest, ALargeGraphComesInParts) {
  api::PoseGraphState state;
  state.epoch = 8;
  state.nodes.resize(1500);
  for (PoseNode& node : state.nodes) node.time = absl::UnixEpoch();
  state.constraints.resize(600);
  state.planes.resize(4);
  state.planes[1].supports.resize(5000);
  ON_CALL(db_.posegraph(), Get(_, _)).WillByDefault(Return(state));
  const auto stub = v1::PoseGraph::NewStub(channel_);
  grpc::ClientContext context;
  const auto reader = stub->Get(&context, {});
  std::vector<int> nodes;
  std::vector<int> constraints;
  std::vector<int> planes;
  for (v1::GetPoseGraphResponse message; reader->Read(&message);) {
    nodes.push_back(message.nodes_size());
    constraints.push_back(message.constraints_size());
    planes.push_back(message.planes_size());
    EXPECT_EQ(message.epoch(), 8U);
  }
  EXPECT_THAT(translate::FromGrpcStatus(reader->Finish()), IsOk());
  EXPECT_THAT(nodes, ElementsAre(1024, 476, 0, 0));
  EXPECT_THAT(constraints, ElementsAre(0, 548, 52, 0));
  EXPECT_THAT(planes, ElementsAre(0, 0, 2, 2));
}

TEST_F(PoseGraphTest, ProposalsAreDecided) {
  JobInfo job;
  job.id = 12;
  job.created = job.updated = absl::UnixEpoch();
  EXPECT_CALL(db_.jobs(), Accept(_, absl::string_view("campus"), 12)).WillOnce(Return(job));
  EXPECT_CALL(db_.jobs(), Revert(_, absl::string_view("campus"), 12))
      .WillOnce(Return(absl::FailedPreconditionError("job 12 is running")));
  v1::AcceptJobRequest accept;
  accept.set_map("campus");
  accept.set_id(12);
  v1::AcceptJobResponse accepted;
  EXPECT_THAT(Call<v1::Jobs>(&v1::Jobs::Stub::Accept, accept, &accepted), IsOk());
  EXPECT_EQ(accepted.job().state(), v1::JOB_STATE_QUEUED);
  v1::RevertJobRequest revert;
  revert.set_map("campus");
  revert.set_id(12);
  v1::RevertJobResponse reverted;
  EXPECT_THAT(Call<v1::Jobs>(&v1::Jobs::Stub::Revert, revert, &reverted),
              StatusIs(Code::kFailedPrecondition, "job 12 is running"));
}

}  // namespace
}  // namespace strata::server
