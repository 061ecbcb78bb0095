// Who is let in, while the file of tokens changes under the server.
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/access/token_file.h"
#include "strata/v1/jobs.grpc.pb.h"
#include "strata/v1/maps.grpc.pb.h"
#include "strata/v1/scans.grpc.pb.h"
#include "tests/server/new_grant.h"
#include "tests/server/raw_call.h"
#include "tests/server/served_mock.h"
#include "tests/support/temp_dir.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Return;
using Code = absl::StatusCode;

class AccessTest : public ServedMock {
 protected:
  std::string Give(const std::string& name, MapRights maps) {
    const auto [grant, token] = NewGrant(name, std::move(maps));
    AddToFile(file_, grant);
    return "Bearer " + token;
  }
  void RevokeAll() { STRATA_ASSERT_OK(WriteTokenFile(file_, {})); }
  void ServeWithTokens() {
    ServerOptions options;
    options.token_file = file_;
    Serve(options);
  }
  absl::StatusOr<v1::ListMapsResponse> ListMaps(const std::string& token) {
    grpc::ClientContext context;
    context.AddMetadata("authorization", token);
    v1::ListMapsResponse out;
    const absl::Status status =
        Call<v1::Maps>(&v1::Maps::Stub::List, v1::ListMapsRequest(), &out, &context);
    if (!status.ok()) return status;
    return out;
  }
  // The server looks at the file once a second.
  template <typename Condition>
  static bool Within(absl::Duration time, const Condition& condition) {
    const absl::Time end = absl::Now() + time;
    while (absl::Now() < end) {
      if (condition()) return true;
      absl::SleepFor(absl::Milliseconds(20));
    }
    return condition();
  }

  testing::TempDir dir_;
  const std::filesystem::path file_ = dir_.path() / "tokens.json";
};

TEST_F(AccessTest, ListsOnlyTheMapsOneMayRead) {
  const std::string robot = Give("robot", {{"campus", Right::kWrite}, {"harbour", Right::kRead}});
  const std::string all = Give("all", {{kAllMaps, Right::kRead}});
  const std::string none = Give("none", {{"moon", Right::kAdmin}});
  ServeWithTokens();
  std::vector<MapInfo> maps(3);
  maps[0].name = "campus";
  maps[1].name = "harbour";
  maps[2].name = "secret";
  ON_CALL(db_.maps(), List(_)).WillByDefault(Return(maps));
  const auto names = [this](const std::string& token) {
    std::vector<std::string> listed;
    const auto answer = ListMaps(token);
    EXPECT_THAT(answer, IsOk());
    if (answer.ok()) {
      for (const v1::MapInfo& map : answer->maps()) listed.push_back(map.name());
    }
    return listed;
  };
  EXPECT_THAT(names(robot), ::testing::ElementsAre("campus", "harbour"));
  EXPECT_THAT(names(all), ::testing::ElementsAre("campus", "harbour", "secret"));
  EXPECT_THAT(names(none), ::testing::IsEmpty());
}

TEST_F(AccessTest, TheDatabaseLearnsWhoAsks) {
  const std::string robot = Give("robot7", {{kAllMaps, Right::kRead}});
  ServeWithTokens();
  std::string principal;
  ON_CALL(db_.maps(), List(_)).WillByDefault([&principal](const api::Call& call) {
    principal = call.principal;
    return absl::StatusOr<std::vector<MapInfo>>(std::vector<MapInfo>());
  });
  EXPECT_THAT(ListMaps(robot), IsOk());
  EXPECT_EQ(principal, "robot7");
}

TEST_F(AccessTest, AddingAndRevokingNeedNoRestart) {
  const std::string first = Give("first", {{kAllMaps, Right::kRead}});
  ServeWithTokens();
  ON_CALL(db_.maps(), List(_)).WillByDefault(Return(std::vector<MapInfo>()));
  EXPECT_THAT(ListMaps(first), IsOk());
  const std::string second = Give("second", {{kAllMaps, Right::kRead}});
  EXPECT_TRUE(Within(absl::Seconds(5), [&] { return ListMaps(second).ok(); }));
  RevokeAll();
  EXPECT_TRUE(
      Within(absl::Seconds(5), [&] { return absl::IsUnauthenticated(ListMaps(first).status()); }));
  EXPECT_THAT(ListMaps(second), StatusIs(Code::kUnauthenticated, HasSubstr("revoked")));
}

TEST_F(AccessTest, AWatchEndsWhenItsTokenIsRevoked) {
  const std::string robot = Give("robot", {{"campus", Right::kRead}});
  ServeWithTokens();
  JobInfo job;
  job.state = JobState::kRunning;
  ON_CALL(db_.jobs(), Get(_, _, _)).WillByDefault(Return(job));
  const auto stub = v1::Jobs::NewStub(channel_);
  grpc::ClientContext context;
  context.AddMetadata("authorization", robot);
  v1::WatchJobRequest in;
  in.set_map("campus");
  const auto reader = stub->Watch(&context, in);
  v1::WatchJobResponse out;
  ASSERT_TRUE(reader->Read(&out));
  RevokeAll();
  EXPECT_FALSE(reader->Read(&out));
  EXPECT_THAT(translate::FromGrpcStatus(reader->Finish()),
              StatusIs(Code::kUnauthenticated, HasSubstr("revoked")));
}

TEST_F(AccessTest, IngestAsksAgainForEveryScan) {
  const std::string robot = Give("robot", {{"campus", Right::kWrite}, {"harbour", Right::kRead}});
  ServeWithTokens();
  EXPECT_CALL(db_.scans(), Upload(_, absl::string_view("harbour"), _)).Times(0);
  EXPECT_CALL(db_.scans(), Upload(_, absl::string_view("campus"), _))
      .Times(2)
      .WillRepeatedly([](auto&, auto, auto&) -> absl::StatusOr<std::unique_ptr<api::ScanUpload>> {
        return absl::AbortedError("got through");
      });
  const auto stub = v1::Scans::NewStub(channel_);
  grpc::ClientContext context;
  context.AddMetadata("authorization", robot);
  const auto stream = stub->Ingest(&context);
  const auto code_of = [&stream](const std::string& map) {
    v1::IngestScansRequest in;
    in.mutable_start()->set_map(map);
    in.mutable_start()->mutable_header()->mutable_id()->set_trajectory("run");
    in.mutable_start()->mutable_header()->set_point_count(1);
    v1::IngestScansResponse out;
    EXPECT_TRUE(stream->Write(in));
    EXPECT_TRUE(stream->Read(&out));
    return static_cast<Code>(out.error().code());
  };
  EXPECT_EQ(code_of("campus"), Code::kAborted);
  EXPECT_EQ(code_of("harbour"), Code::kPermissionDenied);
  EXPECT_EQ(code_of("campus"), Code::kAborted);
  RevokeAll();
  absl::SleepFor(absl::Milliseconds(1100));
  v1::IngestScansRequest in;
  in.mutable_start()->set_map("campus");
  stream->Write(in);
  v1::IngestScansResponse out;
  EXPECT_FALSE(stream->Read(&out));
  EXPECT_THAT(translate::FromGrpcStatus(stream->Finish()), StatusIs(Code::kUnauthenticated, _));
}

TEST_F(AccessTest, HealthNeedsNoTokenAndReflectionIsNotThere) {
  const std::string token = Give("robot", {{kAllMaps, Right::kRead}});
  ServeWithTokens();
  EXPECT_TRUE(CallRaw(channel_, "/grpc.health.v1.Health/Check", "").status.ok());
  const auto reflection = [this](const std::map<std::string, std::string>& metadata) {
    return CallRaw(channel_,
                   "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                   std::string("\x3A\x00", 2),
                   metadata)
        .status.error_code();
  };
  EXPECT_EQ(reflection({}), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(reflection({{"authorization", token}}), grpc::StatusCode::UNIMPLEMENTED);
}

TEST_F(AccessTest, WithoutItsTokenFileAServerDoesNotStart) {
  ServerOptions options;
  options.listen = "127.0.0.1:0";
  options.token_file = file_;
  EXPECT_THAT(Server::Start(db_, options), StatusIs(Code::kNotFound, HasSubstr("tokens.json")));
}

TEST_F(AccessTest, WhatItListensToDependsOnWhatProtectsIt) {
  Give("robot", {{kAllMaps, Right::kRead}});
  ServerOptions options;
  const auto exposed = [&options](const char* listen) {
    options.listen = listen;
    return CheckExposure(options);
  };
  EXPECT_THAT(exposed("127.0.0.1:0"), IsOk());
  EXPECT_THAT(exposed("0.0.0.0:0"), StatusIs(Code::kFailedPrecondition, HasSubstr("--tokens")));
  options.token_file = file_;
  EXPECT_THAT(exposed("[::]:0"), StatusIs(Code::kFailedPrecondition, HasSubstr("plain text")));
  EXPECT_THAT(exposed("[::1]:0"), IsOk());
  options.tls.certificate = "c.pem";
  options.tls.key = "k.pem";
  EXPECT_THAT(exposed("0.0.0.0:0"), IsOk());
  options.token_file.clear();
  EXPECT_THAT(exposed("0.0.0.0:0"), StatusIs(Code::kFailedPrecondition, HasSubstr("--tokens")));
  options.tls.client_ca = "ca.pem";
  EXPECT_THAT(exposed("0.0.0.0:0"), IsOk());
  options.tls = {};
  options.tls.certificate = "c.pem";
  EXPECT_THAT(exposed("127.0.0.1:0"), StatusIs(Code::kInvalidArgument, HasSubstr("only one")));
  options.tls = {};
  options.insecure = true;
  EXPECT_THAT(exposed("0.0.0.0:0"), IsOk());
}

}  // namespace
}  // namespace strata::server
