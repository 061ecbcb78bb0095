// What one client can do to the others, on a real server.
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/common/blocking.h"
#include "core/common/retry_delay.h"
#include "strata/v1/classifiers.grpc.pb.h"
#include "strata/v1/maps.grpc.pb.h"
#include "strata/v1/planning.grpc.pb.h"
#include "strata/v1/posegraph.grpc.pb.h"
#include "strata/v1/scans.grpc.pb.h"
#include "strata/v1/tiles.grpc.pb.h"
#include "tests/server/new_grant.h"
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

class ClientLimitTest : public ServedMock {
 protected:
  std::string Give(const std::string& name) {
    const auto [grant, token] = NewGrant(name, {{kAllMaps, Right::kWrite}});
    AddToFile(file_, grant);
    return "Bearer " + token;
  }
  absl::Status ListMaps(const std::string& token = "") {
    grpc::ClientContext context;
    if (!token.empty()) context.AddMetadata("authorization", token);
    v1::ListMapsResponse out;
    return Call<v1::Maps>(&v1::Maps::Stub::List, v1::ListMapsRequest(), &out, &context);
  }
  static ServerOptions Impatient() {
    ServerOptions options;
    options.slow_sender_timeout = absl::Milliseconds(200);
    return options;
  }
  static void ExpectSilence(const absl::Status& status) {
    EXPECT_THAT(status, StatusIs(Code::kDeadlineExceeded, HasSubstr("sent nothing for 200ms")));
    EXPECT_EQ(ReasonOf(status), "SLOW_SENDER");
  }

  testing::TempDir dir_;
  const std::filesystem::path file_ = dir_.path() / "tokens.json";
};

TEST_F(ClientLimitTest, OneClientsCallsDoNotKeepAnotherOut) {
  const std::string greedy = Give("greedy");
  const std::string modest = Give("modest");
  ServerOptions options;
  options.token_file = file_;
  options.client.max_calls = 1;
  Serve(options);
  absl::Notification inside;
  absl::Notification go;
  ON_CALL(db_.maps(), List(_)).WillByDefault([&](const api::Call& call) {
    if (call.principal == "greedy") {
      inside.Notify();
      go.WaitForNotification();
    }
    return absl::StatusOr<std::vector<MapInfo>>(std::vector<MapInfo>());
  });
  std::thread holder([&] { EXPECT_THAT(ListMaps(greedy), IsOk()); });
  inside.WaitForNotification();
  const absl::Status refused = ListMaps(greedy);
  EXPECT_THAT(refused, StatusIs(Code::kResourceExhausted, HasSubstr("client greedy has 1 calls")));
  EXPECT_EQ(ReasonOf(refused), "CLIENT_LIMIT");
  EXPECT_THAT(ListMaps(modest), IsOk());
  go.Notify();
  holder.join();
}

TEST_F(ClientLimitTest, OneClientsSearchesHoldUpNobodyElse) {
  const std::string greedy = Give("greedy");
  const std::string modest = Give("modest");
  ServerOptions options;
  options.token_file = file_;
  options.query_threads = 2;
  Serve(options);
  absl::Notification inside;
  ON_CALL(db_.planning(), PlanPath(_, _, _)).WillByDefault([&](const api::Call& call, auto, auto&) {
    if (!inside.HasBeenNotified()) inside.Notify();
    while (call.stop.status().ok()) absl::SleepFor(absl::Milliseconds(1));
    return absl::StatusOr<PlanResult>(call.stop.status());
  });
  ON_CALL(db_.maps(), List(_)).WillByDefault(Return(std::vector<MapInfo>()));
  constexpr int kSearches = 10;
  std::vector<grpc::ClientContext> contexts(kSearches);
  std::vector<std::thread> searches;
  for (grpc::ClientContext& context : contexts) {
    context.AddMetadata("authorization", greedy);
    searches.emplace_back([this, &context] {
      v1::PlanPathRequest in;
      in.set_map("world");
      in.mutable_from();
      in.mutable_to();
      v1::PlanPathResponse out;
      EXPECT_THAT(Call<v1::Planning>(&v1::Planning::Stub::PlanPath, in, &out, &context),
                  StatusIs(Code::kCancelled, _));
    });
  }
  inside.WaitForNotification();
  for (int i = 0; i < 20; ++i) EXPECT_THAT(ListMaps(modest), IsOk());
  for (grpc::ClientContext& context : contexts) context.TryCancel();
  for (std::thread& search : searches) search.join();
}

TEST_F(ClientLimitTest, WhatWaitsForAMapHoldsUpNothingElse) {
  ServerOptions options;
  options.query_threads = 1;
  Serve(options);
  absl::Notification over;
  ON_CALL(db_.scans(), Delete(_, _, _)).WillByDefault([&](const auto&, auto, const auto&) {
    const BlockingScope blocking;
    over.WaitForNotification();
    return absl::OkStatus();
  });
  ON_CALL(db_.maps(), List(_)).WillByDefault(Return(std::vector<MapInfo>()));
  std::vector<std::thread> edits;
  for (int i = 0; i < 10; ++i) {
    edits.emplace_back([this] {
      v1::DeleteScanResponse out;
      EXPECT_THAT(Call<v1::Scans>(&v1::Scans::Stub::Delete, v1::DeleteScanRequest(), &out), IsOk());
    });
  }
  for (int i = 0; i < 20; ++i) EXPECT_THAT(ListMaps(), IsOk());
  over.Notify();
  for (std::thread& edit : edits) edit.join();
}

TEST_F(ClientLimitTest, ReadersThatTakeNothingHoldUpNobody) {
  ServerOptions options;
  options.stream_threads = 1;
  Serve(options);
  ON_CALL(db_.scans(), GetPoints(_, _, _, _))
      .WillByDefault([](const auto&, auto, const auto&, auto sink) {
        PointCloud piece;
        piece.points.assign(20'000, Eigen::Vector3f::Zero());
        absl::Status sent;
        while (sent.ok()) sent = sink(piece);
        return sent;
      });
  ON_CALL(db_.tiles(), List(_, _, _)).WillByDefault(Return(std::vector<api::TileInfo>()));
  const auto scans = v1::Scans::NewStub(channel_);
  std::vector<grpc::ClientContext> contexts(10);
  std::vector<std::unique_ptr<grpc::ClientReader<v1::GetScanPointsResponse>>> readers;
  for (grpc::ClientContext& context : contexts) {
    readers.push_back(scans->GetPoints(&context, v1::GetScanPointsRequest()));
    v1::GetScanPointsResponse first;
    EXPECT_TRUE(readers.back()->Read(&first));
  }
  const auto tiles = v1::Tiles::NewStub(channel_);
  for (int i = 0; i < 20; ++i) {
    grpc::ClientContext context;
    const auto listing = tiles->List(&context, v1::ListTilesRequest());
    v1::ListTilesResponse none;
    EXPECT_FALSE(listing->Read(&none));
    EXPECT_THAT(translate::FromGrpcStatus(listing->Finish()), IsOk());
  }
  for (grpc::ClientContext& context : contexts) context.TryCancel();
  for (auto& reader : readers) reader->Finish();
}

TEST_F(ClientLimitTest, AReaderThatTakesNothingLosesItsStream) {
  ServerOptions options;
  options.slow_reader_timeout = absl::Milliseconds(200);
  Serve(options);
  absl::Status ended;
  absl::Notification over;
  ON_CALL(db_.scans(), GetPoints(_, _, _, _))
      .WillByDefault([&](const auto&, auto, const auto&, auto sink) {
        PointCloud piece;
        piece.points.assign(20'000, Eigen::Vector3f::Zero());
        absl::Status sent;
        while (sent.ok()) sent = sink(piece);
        ended = sent;
        over.Notify();
        return sent;
      });
  grpc::ClientContext context;
  const auto reader = v1::Scans::NewStub(channel_)->GetPoints(&context, v1::GetScanPointsRequest());
  over.WaitForNotification();
  EXPECT_THAT(ended, StatusIs(Code::kDeadlineExceeded, HasSubstr("fell 200ms behind")));
  EXPECT_EQ(ReasonOf(ended), "SLOW_READER");
  context.TryCancel();
  reader->Finish();
}

TEST_F(ClientLimitTest, WhoAsksTooOftenIsToldWhenToComeBack) {
  ServerOptions options;
  options.client.calls_per_second = 5.0;
  options.client.burst = 2.0;
  Serve(options);
  ON_CALL(db_.maps(), List(_)).WillByDefault(Return(std::vector<MapInfo>()));
  absl::Status status = ListMaps();
  for (int i = 0; i < 10 && status.ok(); ++i) status = ListMaps();
  EXPECT_THAT(status, StatusIs(Code::kResourceExhausted, HasSubstr("5 calls/s")));
  EXPECT_EQ(ReasonOf(status), "CLIENT_LIMIT");
  absl::SleepFor(RetryDelayOf(status).value() + absl::Milliseconds(5));
  EXPECT_THAT(ListMaps(), IsOk());
}

TEST_F(ClientLimitTest, ASilentUploadEndsAndIsAbandoned) {
  Serve(Impatient());
  absl::Notification abandoned;
  class Upload final : public api::ScanUpload {
   public:
    explicit Upload(absl::Notification& gone) : gone_(gone) {}
    ~Upload() override { gone_.Notify(); }
    absl::Status Write(const PointCloud&) override { return absl::OkStatus(); }
    absl::StatusOr<ScanAck> Finish() override { return absl::InternalError("never"); }

   private:
    absl::Notification& gone_;
  };
  EXPECT_CALL(db_.scans(), Upload(_, _, _))
      .WillOnce([&](auto&, auto, auto&) -> absl::StatusOr<std::unique_ptr<api::ScanUpload>> {
        return std::make_unique<Upload>(abandoned);
      });
  v1::UploadScanRequest in;
  in.mutable_start()->set_map("campus");
  in.mutable_start()->mutable_header()->mutable_id()->set_trajectory("run");
  in.mutable_start()->mutable_header()->set_point_count(1);
  const auto stub = v1::Scans::NewStub(channel_);
  grpc::ClientContext context;
  v1::UploadScanResponse out;
  const auto writer = stub->Upload(&context, &out);
  writer->Write(in);
  abandoned.WaitForNotification();
  ExpectSilence(translate::FromGrpcStatus(writer->Finish()));
}

TEST_F(ClientLimitTest, ASilentIngestEndsAfterItsAnswers) {
  Serve(Impatient());
  const auto stub = v1::Scans::NewStub(channel_);
  grpc::ClientContext context;
  const auto stream = stub->Ingest(&context);
  v1::IngestScansRequest in;
  in.mutable_start()->mutable_header()->mutable_id()->set_trajectory("../run");
  stream->Write(in);
  v1::IngestScansResponse out;
  EXPECT_TRUE(stream->Read(&out));
  EXPECT_FALSE(stream->Read(&out));
  ExpectSilence(translate::FromGrpcStatus(stream->Finish()));
}

TEST_F(ClientLimitTest, OtherSilentStreamsEndToo) {
  Serve(Impatient());
  const auto posegraph = v1::PoseGraph::NewStub(channel_);
  grpc::ClientContext first;
  v1::LocalizeResponse localized;
  const auto localizing = posegraph->Localize(&first, &localized);
  ExpectSilence(translate::FromGrpcStatus(localizing->Finish()));

  const auto classifiers = v1::Classifiers::NewStub(channel_);
  grpc::ClientContext second;
  v1::ImportClassifierResponse imported;
  const auto importing = classifiers->Import(&second, &imported);
  ExpectSilence(translate::FromGrpcStatus(importing->Finish()));
}

TEST_F(ClientLimitTest, WhoSendsNowAndThenIsNotSilent) {
  Serve(Impatient());
  const auto stub = v1::Scans::NewStub(channel_);
  grpc::ClientContext context;
  const auto stream = stub->Ingest(&context);
  for (int i = 0; i < 8; ++i) {
    v1::IngestScansRequest in;
    in.mutable_start()->mutable_header()->mutable_id()->set_trajectory("../run");
    ASSERT_TRUE(stream->Write(in));
    v1::IngestScansResponse out;
    ASSERT_TRUE(stream->Read(&out));
    absl::SleepFor(absl::Milliseconds(50));
  }
  stream->WritesDone();
  EXPECT_THAT(translate::FromGrpcStatus(stream->Finish()), IsOk());
}

}  // namespace
}  // namespace strata::server
