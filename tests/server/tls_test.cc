#include "server/tls.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "proto/translate/status.h"
#include "server/server.h"
#include "tests/server/new_grant.h"
#include "tests/server/raw_call.h"
#include "tests/server/test_certificates.h"
#include "tests/support/mock_database.h"
#include "tests/support/patience.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::strata::testing::TestAuthority;
using ::strata::testing::TestCertificate;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Return;
using Code = absl::StatusCode;

constexpr char kHost[] = "strata.example";

class TlsTest : public ::testing::Test {
 protected:
  TlsTest() {
    ON_CALL(db_.maps(), List(_)).WillByDefault([this](const api::Call& call) {
      principal_ = call.principal;
      return absl::StatusOr<std::vector<MapInfo>>(std::vector<MapInfo>());
    });
  }

  static TlsFiles FilesOf(const TestCertificate& certificate) {
    return {certificate.certificate, certificate.key, ""};
  }
  ServerOptions OptionsOf(const std::string& common_name) const {
    ServerOptions options;
    options.tls = FilesOf(authority_.Issue("server", common_name));
    return options;
  }
  void Serve(const ServerOptions& with) {
    ServerOptions options = with;
    options.listen = "127.0.0.1:0";
    STRATA_ASSERT_OK_AND_ASSIGN(server_, Server::Start(db_, options));
  }
  ClientOptions Client() const {
    ClientOptions options;
    options.target = server_->address();
    options.tls.ca_file = authority_.certificate();
    options.connect_timeout = absl::Seconds(2);
    options.backoff.max_attempts = 1;
    return options;
  }
  static absl::Status ListMaps(const ClientOptions& options) {
    const auto db = Connect(options);
    if (!db.ok()) return db.status();
    return (*db)->maps().List({}).status();
  }
  std::string Give(const std::string& name, bool certificate) {
    auto [grant, token] = NewGrant(name, {{kAllMaps, Right::kRead}});
    if (certificate) grant.secret_sha256.clear();
    AddToFile(tokens_, grant);
    return token;
  }

  testing::TempDir dir_;
  const std::filesystem::path tokens_ = dir_.path() / "tokens.json";
  const TestAuthority authority_{dir_.path(), "authority"};
  ::strata::testing::MockDatabase db_;
  std::string principal_;
  std::unique_ptr<Server> server_;
};

TEST_F(TlsTest, CheckTellsWhoAndUntilWhen) {
  const TestCertificate good = authority_.Issue("server", kHost);
  STRATA_ASSERT_OK_AND_ASSIGN(const TlsCertificate certificate,
                              CheckTls(FilesOf(good), absl::Now()));
  EXPECT_THAT(certificate.subject, HasSubstr(kHost));
  EXPECT_LT(absl::AbsDuration(certificate.expires - absl::Now() - absl::Hours(1)),
            absl::Seconds(30));
}

TEST_F(TlsTest, CheckNamesWhatIsWrong) {
  const TestCertificate good = authority_.Issue("server", kHost);
  const TestCertificate other = authority_.Issue("other", kHost);
  const auto check = [](const TlsFiles& files) { return CheckTls(files, absl::Now()).status(); };
  EXPECT_THAT(check({good.certificate, other.key, ""}),
              StatusIs(Code::kInvalidArgument, HasSubstr("other.key is not the key")));
  EXPECT_THAT(check({"/nowhere.pem", good.key, ""}),
              StatusIs(Code::kNotFound, HasSubstr("/nowhere.pem")));
  EXPECT_THAT(check({good.key, good.key, ""}),
              StatusIs(Code::kInvalidArgument, HasSubstr("holds no certificate")));
  EXPECT_THAT(check({good.certificate, good.certificate, ""}),
              StatusIs(Code::kInvalidArgument, HasSubstr("private key")));
  EXPECT_THAT(check({good.certificate, good.key, good.key}),
              StatusIs(Code::kInvalidArgument, HasSubstr("server.key holds no certificate")));
  const auto expired = authority_.Issue("expired", kHost, -absl::Hours(2), -absl::Hours(1));
  EXPECT_THAT(check(FilesOf(expired)),
              StatusIs(Code::kFailedPrecondition, HasSubstr("valid from")));
  const auto early = authority_.Issue("early", kHost, absl::Hours(1), absl::Hours(2));
  EXPECT_THAT(check(FilesOf(early)), StatusIs(Code::kFailedPrecondition, HasSubstr("valid from")));
  ServerOptions options;
  options.tls = FilesOf(expired);
  EXPECT_THAT(Server::Start(db_, options), StatusIs(Code::kFailedPrecondition, HasSubstr("valid")));
}

TEST_F(TlsTest, OnlyWhoTrustsTheServersAuthorityTalksToIt) {
  Serve(OptionsOf(kHost));
  EXPECT_THAT(ListMaps(Client()), IsOk());
  ClientOptions by_name = Client();
  by_name.tls.server_name = kHost;
  EXPECT_THAT(ListMaps(by_name), IsOk());
  by_name.tls.server_name = "other.example";
  EXPECT_THAT(ListMaps(by_name), StatusIs(Code::kUnavailable, HasSubstr("certificate")));
  ClientOptions elsewhere = Client();
  elsewhere.tls.ca_file = TestAuthority(dir_.path(), "elsewhere").certificate();
  EXPECT_THAT(ListMaps(elsewhere), StatusIs(Code::kUnavailable, HasSubstr("certificate")));
  ClientOptions plain = Client();
  plain.tls = {};
  EXPECT_THAT(ListMaps(plain), StatusIs(Code::kUnavailable, HasSubstr("wants TLS")));
}

TEST_F(TlsTest, AnotherCertificateIsTakenUpWithoutARestart) {
  Serve(OptionsOf(kHost));
  ClientOptions old_name = Client();
  old_name.tls.server_name = kHost;
  ASSERT_THAT(ListMaps(old_name), IsOk());
  authority_.Issue("server", "new.example");
  ClientOptions new_name = Client();
  new_name.tls.server_name = "new.example";
  new_name.connect_timeout = absl::Seconds(1);
  const absl::Time end = absl::Now() + testing::kPatience;
  absl::Status status = ListMaps(new_name);
  while (!status.ok() && absl::Now() < end) status = ListMaps(new_name);
  EXPECT_THAT(status, IsOk());
}

TEST_F(TlsTest, MutualTlsWantsACertificateOfItsAuthority) {
  const TestAuthority clients(dir_.path(), "clients");
  ServerOptions options = OptionsOf(kHost);
  options.tls.client_ca = clients.certificate();
  Serve(options);
  EXPECT_THAT(ListMaps(Client()), StatusIs(Code::kUnavailable, _));
  const auto with = [this](const TestCertificate& own) {
    ClientOptions client = Client();
    client.tls.certificate_file = own.certificate;
    client.tls.key_file = own.key;
    return client;
  };
  EXPECT_THAT(ListMaps(with(clients.Issue("robot7", "robot7"))), IsOk());
  EXPECT_EQ(principal_, "robot7");
  EXPECT_THAT(ListMaps(with(authority_.Issue("stranger", "robot7"))),
              StatusIs(Code::kUnavailable, _));
  const auto expired = clients.Issue("old", "robot7", -absl::Hours(2), -absl::Hours(1));
  EXPECT_THAT(ListMaps(with(expired)), StatusIs(Code::kUnavailable, _));
}

TEST_F(TlsTest, ACertificatesNameMayHaveAGrantAndATokenGoesBeforeIt) {
  const TestAuthority clients(dir_.path(), "clients");
  Give("robot7", /*certificate=*/true);
  const std::string token = Give("ada", /*certificate=*/false);
  ServerOptions options = OptionsOf(kHost);
  options.token_file = tokens_;
  options.tls.client_ca = clients.certificate();
  Serve(options);
  const auto with = [&](const std::string& name) {
    const TestCertificate own = clients.Issue(name, name);
    ClientOptions client = Client();
    client.tls.certificate_file = own.certificate;
    client.tls.key_file = own.key;
    return client;
  };
  EXPECT_THAT(ListMaps(with("robot7")), IsOk());
  EXPECT_EQ(principal_, "robot7");
  EXPECT_THAT(ListMaps(with("robot8")),
              StatusIs(Code::kUnauthenticated, HasSubstr("'robot8' has no grant")));
  // The name of a token's grant is no name for certificates.
  EXPECT_THAT(ListMaps(with("ada")), StatusIs(Code::kUnauthenticated, HasSubstr("no grant")));
  ClientOptions both = with("robot7");
  both.token = token;
  EXPECT_THAT(ListMaps(both), IsOk());
  EXPECT_EQ(principal_, "ada");
}

TEST_F(TlsTest, ReflectionIsForWhoeverIsKnownAndHealthForAll) {
  const std::string token = Give("ada", /*certificate=*/false);
  ServerOptions options = OptionsOf(kHost);
  options.token_file = tokens_;
  Serve(options);
  std::ifstream file(authority_.certificate());
  grpc::SslCredentialsOptions ssl;
  ssl.pem_root_certs.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  const auto channel = grpc::CreateChannel(server_->address(), grpc::SslCredentials(ssl));
  const auto reflect = [&](const std::map<std::string, std::string>& metadata) {
    return CallRaw(channel,
                   "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                   std::string("\x3A\x00", 2),
                   metadata);
  };
  EXPECT_EQ(reflect({}).status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  const RawAnswer answer = reflect({{"authorization", "Bearer " + token}});
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_THAT(answer.messages.at(0), HasSubstr("strata.v1.Maps"));
  EXPECT_TRUE(CallRaw(channel, "/grpc.health.v1.Health/Check", "").status.ok());
}

TEST_F(TlsTest, AClientDoesNotShowItsTokenInPlainText) {
  ClientOptions options;
  options.token = "strata_x";
  options.connect_timeout = absl::Milliseconds(1);
  options.target = "192.0.2.1:1";
  EXPECT_THAT(Connect(options), StatusIs(Code::kFailedPrecondition, HasSubstr("plain text")));
  options.insecure = true;
  EXPECT_THAT(Connect(options), StatusIs(Code::kUnavailable, _));
  options.insecure = false;
  options.target = "127.0.0.1:1";
  EXPECT_THAT(Connect(options), StatusIs(Code::kUnavailable, _));
  options.token = "two\nlines";
  EXPECT_THAT(Connect(options), StatusIs(Code::kInvalidArgument, HasSubstr("token")));
  options = {};
  options.tls.certificate_file = "c.pem";
  EXPECT_THAT(Connect(options), StatusIs(Code::kInvalidArgument, HasSubstr("only one")));
}

}  // namespace
}  // namespace strata::server
