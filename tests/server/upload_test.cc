#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "strata/v1/scans.grpc.pb.h"
#include "tests/server/scan_sink.h"
#include "tests/server/served_mock.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Code = absl::StatusCode;

class UploadTest : public ServedMock {
 protected:
  void SetUp() override { Serve(); }

  static v1::UploadScanRequest Message(const v1::ScanStart& start) {
    v1::UploadScanRequest message;
    *message.mutable_start() = start;
    return message;
  }
  static v1::UploadScanRequest Message(const v1::PointChunk& chunk) {
    v1::UploadScanRequest message;
    *message.mutable_chunk() = chunk;
    return message;
  }

  absl::Status Upload(const std::vector<v1::UploadScanRequest>& messages) {
    const auto stub = v1::Scans::NewStub(channel_);
    grpc::ClientContext context;
    const auto writer = stub->Upload(&context, &response_);
    for (const v1::UploadScanRequest& message : messages) {
      if (!writer->Write(message)) break;
    }
    writer->WritesDone();
    return translate::FromGrpcStatus(writer->Finish());
  }

  ScanSink sink_{db_};
  v1::UploadScanResponse response_;
};

TEST_F(UploadTest, AScanInPiecesIsCommittedOnceAndAcknowledged) {
  EXPECT_THAT(Upload({Message(StartOf(7, 5)), Message(Points(3)), Message(Points(2))}), IsOk());
  EXPECT_THAT(sink_.committed(), ElementsAre("run/7: 5"));
  EXPECT_EQ(response_.ack().id().sequence(), 7U);
  EXPECT_EQ(response_.ack().commit_sequence(), 1U);
}

TEST_F(UploadTest, RefusesMessagesOutOfOrder) {
  EXPECT_THAT(Upload({}), StatusIs(Code::kInvalidArgument, HasSubstr("before its scan began")));
  EXPECT_THAT(Upload({Message(Points(1))}),
              StatusIs(Code::kInvalidArgument, HasSubstr("first message is the start")));
  EXPECT_THAT(Upload({Message(StartOf(1, 5)), Message(StartOf(2, 5))}),
              StatusIs(Code::kInvalidArgument, HasSubstr("after the first is a chunk")));
  EXPECT_THAT(Upload({Message(StartOf(1, 5)), v1::UploadScanRequest()}),
              StatusIs(Code::kInvalidArgument, HasSubstr("after the first is a chunk")));
  EXPECT_THAT(sink_.committed(), IsEmpty());
}

TEST_F(UploadTest, RefusesMoreAndFewerPointsThanAnnounced) {
  EXPECT_THAT(
      Upload({Message(StartOf(1, 5)), Message(Points(3)), Message(Points(3))}),
      StatusIs(Code::kInvalidArgument, HasSubstr("6 points arrived, the header announced 5")));
  EXPECT_THAT(
      Upload({Message(StartOf(1, 5)), Message(Points(3))}),
      StatusIs(Code::kInvalidArgument, HasSubstr("3 points arrived, the header announced 5")));
  EXPECT_THAT(sink_.committed(), IsEmpty());
}

TEST_F(UploadTest, RefusesPointsThatAreNotFinite) {
  v1::PointChunk chunk = Points(2);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  chunk.mutable_xyz()->replace(16, 4, reinterpret_cast<const char*>(&nan), 4);
  const absl::Status status =
      Upload({Message(StartOf(1, 42)), Message(Points(40)), Message(chunk)});
  EXPECT_THAT(status, StatusIs(Code::kInvalidArgument, HasSubstr("scan run/1: point 41 (1, nan")));
  EXPECT_EQ(ReasonOf(status), "REQUEST");
  sink_.AwaitAbandoned();
}

TEST_F(UploadTest, RefusesBadHeadersBeforePoints) {
  v1::ScanStart start = StartOf(1, 5);
  start.mutable_header()->mutable_id()->set_trajectory("../run");
  EXPECT_THAT(Upload({Message(start)}),
              StatusIs(Code::kInvalidArgument, HasSubstr("trajectory name '../run'")));
  start = StartOf(1, 5);
  start.mutable_header()->set_rows(2);
  start.mutable_header()->set_columns(2);
  EXPECT_THAT(Upload({Message(start)}), StatusIs(Code::kInvalidArgument, HasSubstr("grid of 2")));
  start = StartOf(1, 5);
  start.set_map("nowhere");
  EXPECT_THAT(Upload({Message(start)}), StatusIs(Code::kNotFound, HasSubstr("nowhere")));
}

TEST_F(UploadTest, PointsThatAreThereAreNotTakenTwice) {
  v1::ScanStart start = StartOf(1, 9);
  start.mutable_header()->set_content_hash(std::string(32, 'a'));
  // A client that knows nothing of it sends them all the same.
  EXPECT_THAT(Upload({Message(start), Message(Points(3)), Message(Points(3)), Message(Points(3))}),
              IsOk());
  start.set_resume(true);
  EXPECT_THAT(Upload({Message(start), Message(Points(5))}), IsOk());
  EXPECT_THAT(sink_.committed(), ElementsAre("run/1: 5", "run/1: 5"));
  EXPECT_THAT(
      Upload({Message(start), Message(Points(6))}),
      StatusIs(Code::kInvalidArgument, HasSubstr("10 points arrived, the header announced 9")));
}

TEST_F(UploadTest, AScanThatIsThereIsAcknowledgedBeforeItsPoints) {
  v1::ScanStart start = StartOf(1, 4);
  start.mutable_header()->set_content_hash(std::string(32, 'a'));
  const auto stub = v1::Scans::NewStub(channel_);
  grpc::ClientContext context;
  const auto writer = stub->Upload(&context, &response_);
  ASSERT_TRUE(writer->Write(Message(start)));
  EXPECT_TRUE(writer->Finish().ok());  // without half-close
  EXPECT_EQ(response_.ack().id().sequence(), 1U);
  const auto& metadata = context.GetServerInitialMetadata();
  ASSERT_EQ(metadata.count("x-upload-accepted"), 1U);
  EXPECT_EQ(metadata.find("x-upload-accepted")->second, "4");
}

TEST_F(UploadTest, AClientThatGoesAwayLeavesNoTrace) {
  const auto stub = v1::Scans::NewStub(channel_);
  grpc::ClientContext context;
  const auto writer = stub->Upload(&context, &response_);
  ASSERT_TRUE(writer->Write(Message(StartOf(1, 5))));
  writer->WaitForInitialMetadata();
  EXPECT_EQ(context.GetServerInitialMetadata().count("x-upload-accepted"), 1U);
  ASSERT_TRUE(writer->Write(Message(Points(4))));
  context.TryCancel();
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::CANCELLED);
  sink_.AwaitAbandoned();
  EXPECT_THAT(sink_.committed(), IsEmpty());
}

}  // namespace
}  // namespace strata::server
