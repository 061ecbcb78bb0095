// Servers of one store: what one has not another has, and the client finds it.
#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/map_owner.h"
#include "core/common/retry_delay.h"
#include "tests/client/sdk/connected_mock.h"

namespace strata::sdk {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::NiceMock;
using Code = absl::StatusCode;

// `client_` knows one server only, which has no map; another one has it.
class OwnerTest : public ConnectedMock {
 protected:
  void SetUp() override {
    ConnectedMock::SetUp();
    server::ServerOptions options;
    options.listen = "127.0.0.1:0";
    auto owner = server::Server::Start(owner_db_, options);
    ASSERT_THAT(owner, ::strata::testing::IsOk());
    owner_ = *std::move(owner);
    named_ = owner_->address();
    const auto refuse = [this] {
      ++refused_;
      return WithRetryDelay(
          WithMapOwner(absl::UnavailableError("map m is in use by another server"), named_),
          absl::Milliseconds(1));
    };
    for (auto* db : {&behind_, &owner_db_}) {
      ON_CALL(db->maps(), Get(_, _)).WillByDefault(::testing::Return(MapInfo()));
    }
    ON_CALL(behind_.maps(), Stats(_, _)).WillByDefault([=](auto&, auto) { return refuse(); });
    ON_CALL(behind_.maps(), Watch(_, _, _, _)).WillByDefault([=](auto&, auto, auto&, auto) {
      return refuse();
    });
    ON_CALL(behind_.jobs(), Start(_, _, _, _)).WillByDefault([=](auto&, auto, auto, auto&) {
      return refuse();
    });
    ON_CALL(behind_.scans(), Upload(_, _, _)).WillByDefault([=](auto&, auto, auto&) {
      return refuse();
    });
    ON_CALL(behind_.classifiers(), Import(_, _, _, _)).WillByDefault([=](auto&, auto, auto, auto) {
      return refuse();
    });
  }
  // Another client of the same server.
  absl::StatusOr<std::unique_ptr<api::Database>> ConnectWith(ClientOptions options) const {
    options.target = server_->address();
    options.backoff.initial = absl::Milliseconds(1);
    options.backoff.max_attempts = 3;
    options.backoff.retry_for = absl::ZeroDuration();
    return Connect(options);
  }

  ::strata::testing::MockDatabase owner_db_;
  std::unique_ptr<server::Server> owner_;
  std::string named_;  // what the server without the map calls the other
  std::atomic<int> refused_ = 0;
};

TEST_F(OwnerTest, CallsGoToTheServerThatIsNamed) {
  EXPECT_CALL(owner_db_.jobs(), Start(_, _, _, _)).WillOnce([](auto&, auto, auto, auto&) {
    JobInfo job;
    job.id = 7;
    return job;
  });
  const auto job = client_->jobs().Start({}, "m", "verify", {});
  ASSERT_THAT(job, ::strata::testing::IsOk());
  EXPECT_EQ(job->id, 7U);
  EXPECT_CALL(owner_db_.classifiers(), Import(_, _, _, _)).WillOnce([](auto&, auto, auto, auto) {
    return ClassifierInfo();
  });
  EXPECT_THAT(client_->classifiers().Import({}, "m", "c", "bytes"), ::strata::testing::IsOk());
  EXPECT_EQ(refused_, 2);  // each asks at home first
}

TEST_F(OwnerTest, SoDoUploads) {
  EXPECT_CALL(owner_db_.scans(), Upload(_, _, _)).WillOnce([](auto&, auto, const auto& header) {
    auto upload = std::make_unique<NiceMock<::strata::testing::MockScanUpload>>();
    ON_CALL(*upload, Write(_)).WillByDefault(::testing::Return(absl::OkStatus()));
    ScanAck ack;
    ack.id = header.id;
    ack.commit_sequence = 5;
    ON_CALL(*upload, Finish()).WillByDefault(::testing::Return(ack));
    return absl::StatusOr<std::unique_ptr<api::ScanUpload>>(std::move(upload));
  });
  PointCloud cloud;
  cloud.points = {{1.0F, 2.0F, 3.0F}};
  ScanHeader header;
  header.id = {"run", 1};
  header.point_count = 1;
  const auto upload = client_->scans().Upload({}, "m", header);
  ASSERT_THAT(upload, ::strata::testing::IsOk());
  EXPECT_THAT((*upload)->Write(cloud), ::strata::testing::IsOk());
  const auto ack = (*upload)->Finish();
  ASSERT_THAT(ack, ::strata::testing::IsOk());
  EXPECT_EQ(ack->commit_sequence, 5U);
}

// And home again when that one is gone, which then has the map.
TEST_F(OwnerTest, AWatchGoesThereAndComesBack) {
  ON_CALL(owner_db_.maps(), Watch(_, _, _, _)).WillByDefault([](auto&, auto, auto&, auto sink) {
    api::MapUpdate update;
    update.commit_sequence = 11;
    return sink(update);
  });
  std::uint64_t last = 0;
  const absl::Status ended = client_->maps().Watch({}, "m", {}, [&](const auto& update) {
    last = update.commit_sequence;
    if (last == 12) return absl::OutOfRangeError("enough");
    ON_CALL(behind_.maps(), Watch(_, _, _, _)).WillByDefault([](auto&, auto, auto&, auto sink) {
      api::MapUpdate newer;
      newer.commit_sequence = 12;
      return sink(newer);
    });
    owner_.reset();
    return absl::OkStatus();
  });
  EXPECT_THAT(ended, StatusIs(Code::kOutOfRange, "enough"));
  EXPECT_EQ(last, 12U);
}

TEST_F(OwnerTest, ANameThatIsNoAddressIsTold) {
  named_ = "the one in the cellar";
  STRATA_ASSERT_OK_AND_ASSIGN(const auto client, ConnectWith({}));
  const absl::Status refused = client->maps().Stats({}, "m").status();
  EXPECT_THAT(refused, StatusIs(Code::kUnavailable, "map m is in use by another server"));
  EXPECT_EQ(MapOwnerOf(refused), named_);
  EXPECT_EQ(RetryDelayOf(refused), absl::Milliseconds(1));
}

TEST_F(OwnerTest, OneThatIsNamedAndNotThereIsNotAskedForEver) {
  owner_.reset();
  STRATA_ASSERT_OK_AND_ASSIGN(const auto client, ConnectWith({}));
  EXPECT_TRUE(absl::IsUnavailable(client->maps().Stats({}, "m").status()));
  EXPECT_LE(refused_, 4);
}

TEST_F(OwnerTest, ATokenIsNotCarriedInPlainTextToWhoeverIsNamed) {
  named_ = "192.0.2.1:50051";  // an address of nobody
  ClientOptions options;
  options.token = "secret";
  STRATA_ASSERT_OK_AND_ASSIGN(const auto client, ConnectWith(options));
  EXPECT_EQ(MapOwnerOf(client->maps().Stats({}, "m").status()), named_);
  EXPECT_EQ(refused_, 3);  // never elsewhere
}

}  // namespace
}  // namespace strata::sdk
