// Who loses his access loses what runs.
#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "strata/v1/maps.grpc.pb.h"
#include "strata/v1/planning.grpc.pb.h"
#include "strata/v1/scans.grpc.pb.h"
#include "tests/server/new_grant.h"
#include "tests/server/scan_sink.h"
#include "tests/server/served_mock.h"
#include "tests/support/temp_dir.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Return;
using Code = absl::StatusCode;

class RevocationTest : public ServedMock {
 protected:
  void SetUp() override {
    const auto [grant, token] = NewGrant("writer", {{kAllMaps, Right::kWrite}});
    token_ = "Bearer " + token;
    AddToFile(file_, grant);
    ServerOptions options;
    options.token_file = file_;
    Serve(options);
    context_.AddMetadata("authorization", token_);
  }
  void Revoke() { STRATA_ASSERT_OK(WriteTokenFile(file_, {})); }
  static void ExpectRevoked(const absl::Status& status) {
    EXPECT_THAT(status, StatusIs(Code::kUnauthenticated, HasSubstr("revoked")));
  }

  ScanSink sink_{db_};
  testing::TempDir dir_;
  const std::filesystem::path file_ = dir_.path() / "tokens.json";
  std::string token_;
  grpc::ClientContext context_;
};

TEST_F(RevocationTest, AnUploadThatWaitsForItsClientEndsAndIsAbandoned) {
  const auto stub = v1::Scans::NewStub(channel_);
  v1::UploadScanResponse out;
  const auto writer = stub->Upload(&context_, &out);
  v1::UploadScanRequest start;
  *start.mutable_start() = StartOf(1, 5);
  ASSERT_TRUE(writer->Write(start));
  writer->WaitForInitialMetadata();
  Revoke();
  ExpectRevoked(translate::FromGrpcStatus(writer->Finish()));
  sink_.AwaitAbandoned();
  EXPECT_THAT(sink_.committed(), IsEmpty());
}

TEST_F(RevocationTest, AnUploadThatGoesOnEnds) {
  const auto stub = v1::Scans::NewStub(channel_);
  v1::UploadScanResponse out;
  const auto writer = stub->Upload(&context_, &out);
  v1::UploadScanRequest message;
  *message.mutable_start() = StartOf(1, 1'000'000);
  ASSERT_TRUE(writer->Write(message));
  Revoke();
  *message.mutable_chunk() = Points(1);
  while (writer->Write(message)) absl::SleepFor(absl::Milliseconds(10));
  ExpectRevoked(translate::FromGrpcStatus(writer->Finish()));
  EXPECT_THAT(sink_.committed(), IsEmpty());
}

TEST_F(RevocationTest, ADownloadEnds) {
  ON_CALL(db_.scans(), GetPoints(_, _, _, _)).WillByDefault([](auto&, auto, auto&, auto sink) {
    PointCloud piece;
    piece.points.resize(10, {1.0F, 2.0F, 3.0F});
    absl::Status status;
    while (status.ok()) {
      status = sink(piece);
      absl::SleepFor(absl::Milliseconds(5));
    }
    return status;
  });
  const auto stub = v1::Scans::NewStub(channel_);
  v1::GetScanPointsRequest in;
  const auto reader = stub->GetPoints(&context_, in);
  v1::GetScanPointsResponse out;
  ASSERT_TRUE(reader->Read(&out));
  Revoke();
  while (reader->Read(&out)) {
  }
  ExpectRevoked(translate::FromGrpcStatus(reader->Finish()));
}

TEST_F(RevocationTest, AQueryThatRunsIsStopped) {
  std::atomic<bool> inside = false;
  ON_CALL(db_.planning(), PlanPath(_, _, _))
      .WillByDefault([&](const api::Call& call, auto, auto&) -> absl::StatusOr<PlanResult> {
        inside = true;
        while (call.stop.status().ok()) absl::SleepFor(absl::Milliseconds(5));
        return call.stop.status();
      });
  const auto stub = v1::Planning::NewStub(channel_);
  v1::PlanPathRequest in;
  in.mutable_from();
  in.mutable_to();
  std::thread revoker([&] {
    while (!inside) absl::SleepFor(absl::Milliseconds(5));
    Revoke();
  });
  v1::PlanPathResponse out;
  ExpectRevoked(translate::FromGrpcStatus(stub->PlanPath(&context_, in, &out)));
  revoker.join();
}

TEST_F(RevocationTest, AWatchEndsAlsoWhereNobodyReadsIt) {
  ON_CALL(db_.maps(), Watch(_, _, _, _)).WillByDefault([](auto&, auto, auto& options, auto sink) {
    api::MapUpdate update;
    update.commit_sequence = options.since + 1;
    update.scans.resize(1024);
    for (api::ScanChange& scan : update.scans) scan.id.trajectory = std::string(100, 'x');
    return sink(update);
  });
  const auto stub = v1::Maps::NewStub(channel_);
  const auto reader = stub->Watch(&context_, {});
  reader->WaitForInitialMetadata();
  Revoke();
  v1::WatchMapResponse out;
  while (reader->Read(&out)) absl::SleepFor(absl::Milliseconds(300));
  EXPECT_THAT(reader->Finish().error_code(),
              AnyOf(grpc::StatusCode::UNAUTHENTICATED, grpc::StatusCode::CANCELLED));
}

TEST_F(RevocationTest, WhoKeepsHisRightsKeepsWhatRuns) {
  const Grant other = NewGrant("other", {{kAllMaps, Right::kRead}}).first;
  const auto stub = v1::Scans::NewStub(channel_);
  v1::UploadScanResponse out;
  const auto writer = stub->Upload(&context_, &out);
  v1::UploadScanRequest message;
  *message.mutable_start() = StartOf(1, 2);
  ASSERT_TRUE(writer->Write(message));
  AddToFile(file_, other);
  absl::SleepFor(absl::Seconds(2));
  *message.mutable_chunk() = Points(2);
  ASSERT_TRUE(writer->Write(message));
  writer->WritesDone();
  EXPECT_THAT(translate::FromGrpcStatus(writer->Finish()), IsOk());
}

}  // namespace
}  // namespace strata::server
