// The parts of the HTTP door that need no socket.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "proto/translate/status.h"
#include "server/web/contract.h"
#include "server/web/hosts.h"
#include "server/web/openapi.h"
#include "server/web/pages.h"
#include "server/web/sessions.h"
#include "server/web/wire.h"
#include "strata/v1/maps.grpc.pb.h"
#include "strata/v1/planning.grpc.pb.h"
#include "strata/v1/scans.grpc.pb.h"
#include "tests/support/status_matchers.h"

namespace strata::server::web {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using Code = absl::StatusCode;

TEST(HostsTest, TakesOnlyNamesThatNobodyElseDecidesOn) {
  const Hosts hosts({"Maps.Example"});
  for (const char* good : {"localhost",
                           "LOCALHOST:8080",
                           "127.0.0.1",
                           "127.0.0.1:1",
                           "[::1]:8080",
                           "192.0.2.7:443",
                           "maps.example",
                           "maps.example.:8080"}) {
    EXPECT_TRUE(hosts.Take(good)) << good;
  }
  for (const char* bad : {"",
                          ":80",
                          "evil.example",
                          "localhost.evil.example",
                          "127.0.0.1.evil.example",
                          "evil.example:8080",
                          "localhost,evil.example",
                          "localhost:80x",
                          "localhost:-1",
                          "localhost:123456",
                          "localhost:",
                          "[::1",
                          "[::1]x",
                          "localhost@evil.example",
                          "maps.example/evil"}) {
    EXPECT_FALSE(hosts.Take(bad)) << bad;
  }
}

TEST(HostsTest, AnOriginIsThatOfThePageItself) {
  EXPECT_TRUE(IsSameOrigin("http://localhost:8080", "localhost:8080"));
  EXPECT_TRUE(IsSameOrigin("http://LOCALHOST", "localhost:80"));
  EXPECT_TRUE(IsSameOrigin("https://maps.example", "maps.example"));
  EXPECT_TRUE(IsSameOrigin("https://maps.example", "maps.example:443"));
  EXPECT_TRUE(IsSameOrigin("http://[::1]:8080", "[::1]:8080"));
  for (const char* bad : {"null",
                          "http://localhost:8081",
                          "http://localhost",
                          "http://evil.example",
                          "ftp://localhost:8080",
                          "file://",
                          "http://"}) {
    EXPECT_FALSE(IsSameOrigin(bad, "localhost:8080")) << bad;
  }
}

TEST(WireTest, EveryCodeHasTheNameAndTheStatusOfConnect) {
  const std::vector<std::pair<std::string, int>> expected = {{"canceled", 499},
                                                             {"unknown", 500},
                                                             {"invalid_argument", 400},
                                                             {"deadline_exceeded", 504},
                                                             {"not_found", 404},
                                                             {"already_exists", 409},
                                                             {"permission_denied", 403},
                                                             {"resource_exhausted", 429},
                                                             {"failed_precondition", 400},
                                                             {"aborted", 409},
                                                             {"out_of_range", 400},
                                                             {"unimplemented", 501},
                                                             {"internal", 500},
                                                             {"unavailable", 503},
                                                             {"data_loss", 500},
                                                             {"unauthenticated", 401}};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto code = static_cast<grpc::StatusCode>(i + 1);
    EXPECT_EQ(CodeName(code), expected[i].first);
    EXPECT_EQ(HttpStatusOf(code), expected[i].second) << expected[i].first;
  }
}

TEST(WireTest, AnErrorHasItsDetailsAndWhatIsNoUtf8IsReplaced) {
  const absl::Status status = translate::WithReason(absl::NotFoundError("map \"x\" does not exist"),
                                                    translate::kDatabaseReason);
  const auto error = nlohmann::json::parse(ErrorJson(translate::ToGrpcStatus(status, "id-7")));
  EXPECT_EQ(error["code"], "not_found");
  EXPECT_THAT(error["message"].get<std::string>(), HasSubstr("does not exist"));
  EXPECT_EQ(error["details"][0]["type"], "strata.v1.ErrorDetail");
  EXPECT_EQ(error["details"][0]["debug"]["reason"], "DATABASE");
  EXPECT_EQ(error["details"][0]["debug"]["metadata"]["request_id"], "id-7");
  const std::string value = error["details"][0]["value"];
  EXPECT_EQ(value.find('='), std::string::npos);
  EXPECT_EQ(ErrorJson(grpc::Status(grpc::ABORTED, "n\xff")),
            "{\"code\":\"aborted\",\"message\":\"n\xef\xbf\xbd\"}");
}

TEST(WireTest, EnvelopesAreReadWholeOrRefused) {
  EXPECT_EQ(Envelope(2, "{}"), std::string("\x02\0\0\0\x02{}", 7));
  EXPECT_EQ(OnlyMessage(Envelope(0, "abc")).value(), "abc");
  EXPECT_EQ(OnlyMessage(Envelope(0, "")).value(), "");
  EXPECT_THAT(OnlyMessage("abc"), StatusIs(Code::kInvalidArgument, HasSubstr("3 bytes")));
  EXPECT_THAT(OnlyMessage(Envelope(1, "abc")), StatusIs(Code::kUnimplemented, _));
  EXPECT_THAT(OnlyMessage(Envelope(0, "abc") + Envelope(0, "d")),
              StatusIs(Code::kInvalidArgument, HasSubstr("announces 3")));
  EXPECT_THAT(OnlyMessage(std::string("\0\xff\xff\xff\xff", 5)),
              StatusIs(Code::kInvalidArgument, HasSubstr("4294967295")));
}

TEST(WireTest, TrailersHoldWhatAHeaderCannot) {
  EXPECT_EQ(WebTrailers(grpc::Status::OK), Envelope(0x80, "grpc-status: 0\r\n"));
  EXPECT_EQ(WebTrailers(grpc::Status(grpc::NOT_FOUND, "a\r\nb %")),
            Envelope(0x80, "grpc-status: 5\r\ngrpc-message: a%0D%0Ab %25\r\n"));
  EXPECT_EQ(ConnectEnd(grpc::Status::OK), Envelope(2, "{}"));
}

TEST(WireTest, TimesAreThoseOfTheProtocols) {
  EXPECT_EQ(ParseConnectTimeout("1500").value(), absl::Milliseconds(1500));
  EXPECT_EQ(ParseConnectTimeout("9999999999").value(), absl::Milliseconds(9999999999));
  for (const char* bad : {"", "-1", "1.5", "12345678901", "1s", " 1"}) {
    EXPECT_THAT(ParseConnectTimeout(bad), StatusIs(Code::kInvalidArgument, _)) << bad;
  }
  EXPECT_EQ(ParseGrpcTimeout("5S").value(), absl::Seconds(5));
  EXPECT_EQ(ParseGrpcTimeout("99999999H").value(), absl::Hours(99999999));
  EXPECT_EQ(ParseGrpcTimeout("20m").value(), absl::Milliseconds(20));
  for (const char* bad : {"", "S", "5", "5s", "123456789S", "-1S"}) {
    EXPECT_THAT(ParseGrpcTimeout(bad), StatusIs(Code::kInvalidArgument, _)) << bad;
  }
}

Contract MapsAndMore() {
  return Contract({v1::Maps::service_full_name(),
                   v1::Planning::service_full_name(),
                   v1::Scans::service_full_name()});
}

TEST(ContractTest, JsonIsThatOfTheProtosAndErrorsNameTheField) {
  const Contract contract = MapsAndMore();
  const auto* method = contract.Find("/strata.v1.Planning/PlanPath");
  ASSERT_NE(method, nullptr);
  const google::protobuf::Descriptor& in = *method->input_type();
  STRATA_ASSERT_OK_AND_ASSIGN(
      const std::string bytes,
      contract.FromJson(in, R"({"map":"campus","from":{"x_m":1.5,"yM":2,"level":1}})"));
  v1::PlanPathRequest request;
  ASSERT_TRUE(request.ParseFromString(bytes));
  EXPECT_EQ(request.from().x_m(), 1.5);
  EXPECT_EQ(request.from().y_m(), 2.0);
  EXPECT_EQ(request.from().level(), 1);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string back, contract.ToJson(in, bytes));
  EXPECT_EQ(back, R"({"map":"campus","from":{"x_m":1.5,"y_m":2,"level":1}})");
  EXPECT_THAT(contract.FromJson(in, R"({"mop":"campus"})"),
              StatusIs(Code::kInvalidArgument, HasSubstr("mop")));
  EXPECT_THAT(contract.FromJson(in, R"({"from":{"x_m":"far"}})"),
              StatusIs(Code::kInvalidArgument, HasSubstr("from.x_m")));
  for (const char* bad : {"", "{", "[]", "7", "{\"map\":", "{\"map\":\"a\"}}"}) {
    EXPECT_THAT(contract.FromJson(in, bad), StatusIs(Code::kInvalidArgument, _)) << bad;
  }
  const std::string deep(100'000, '[');
  EXPECT_THAT(contract.FromJson(in, "{\"map\":" + deep), StatusIs(Code::kInvalidArgument, _));
  EXPECT_EQ(contract.Find("/strata.v1.Planning/Plan"), nullptr);
  EXPECT_EQ(contract.Find("/grpc.health.v1.Health/Check"), nullptr);
}

TEST(OpenApiTest, HasEveryMethodThatHttpReachesAndEverySchemaItNames) {
  const Contract contract = MapsAndMore();
  const auto document = nlohmann::json::parse(OpenApiOf(contract));
  int methods = 0;
  for (const auto* service : contract.services()) {
    for (int i = 0; i < service->method_count(); ++i) {
      const std::string path =
          "/" + service->full_name() + "/" + std::string(service->method(i)->name());
      EXPECT_EQ(document["paths"].contains(path), !service->method(i)->client_streaming()) << path;
      ++methods;
    }
  }
  EXPECT_GT(methods, 20);
  int references = 0;
  const std::function<void(const nlohmann::json&)> visit = [&](const nlohmann::json& node) {
    if (node.is_object() && node.contains("$ref") && node["$ref"].is_string()) {
      const std::string name = node["$ref"].get<std::string>().substr(21);
      EXPECT_TRUE(document["components"]["schemas"].contains(name)) << name;
      ++references;
    }
    for (const auto& child : node) {
      if (child.is_structured()) visit(child);
    }
  };
  visit(document);
  EXPECT_GT(references, 100);
}

TEST(OpenApiTest, SaysWhatTheProtoFilesSay) {
  const auto document = nlohmann::json::parse(OpenApiOf(MapsAndMore()));
  for (const auto& tag : document["tags"]) EXPECT_TRUE(tag.contains("description")) << tag;
  for (const auto& [path, operations] : document["paths"].items()) {
    if (!operations.contains("post")) continue;
    EXPECT_TRUE(operations["post"].contains("description")) << path;
  }
  const auto& schemas = document["components"]["schemas"];
  for (const auto& [name, schema] : schemas.items()) {
    if (name == "Error") continue;
    EXPECT_TRUE(schema.contains("description")) << name;
    if (!schema.contains("properties")) continue;
    for (const auto& [field, about] : schema["properties"].items()) {
      EXPECT_TRUE(about.contains("description")) << name << "." << field;
    }
  }
  const auto& surface = schemas["strata.v1.Surface"]["properties"];
  EXPECT_EQ(surface["depth_m"]["description"],
            "Length of a vertical interval below z_m [m]; 0: horizontal.");
  const std::string kinds = schemas["strata.v1.Traversability"]["description"];
  EXPECT_THAT(kinds, HasSubstr("- TRAVERSABILITY_UNDERSIDE: Seen from below only"));
}

TEST(TilePathTest, IsReadStrictly) {
  const auto tile = ParseTilePath("/v1/maps/a%2Fb/tiles/3/-1/2");
  ASSERT_TRUE(tile.has_value());
  EXPECT_EQ(tile->map, "a/b");
  EXPECT_EQ(tile->level, 3);
  EXPECT_EQ(tile->x, -1);
  EXPECT_EQ(tile->y, 2);
  for (const char* bad : {"/v1/maps/a/tiles/3/1",
                          "/v1/maps/a/tiles/3/1/2/",
                          "/v1/maps/a/tiles/x/1/2",
                          "/v1/maps/a/tiles/3/1/99999999999",
                          "/v1/maps/a%2/tiles/3/1/2",
                          "/v1/maps/a%zz/tiles/3/1/2",
                          "/v2/maps/a/tiles/3/1/2",
                          "v1/maps/a/tiles/3/1/2"}) {
    EXPECT_FALSE(ParseTilePath(bad).has_value()) << bad;
  }
}

class FakeSession : public SessionBase {
 public:
  void Close() override { closed = true; }
  bool closed = false;
};

TEST(SessionsTest, OneThatComesTakesThePlaceOfTheOneThatWaitsLongest) {
  Sessions sessions(2, 100);
  const auto first = std::make_shared<FakeSession>();
  const auto second = std::make_shared<FakeSession>();
  const auto third = std::make_shared<FakeSession>();
  const auto fourth = std::make_shared<FakeSession>();
  ASSERT_TRUE(sessions.Add(first));
  ASSERT_TRUE(sessions.Add(second));
  sessions.SetWaiting(first.get(), false);
  ASSERT_TRUE(sessions.Add(third));
  EXPECT_FALSE(first->closed);
  EXPECT_TRUE(second->closed);
  sessions.Remove(second.get());  // as it does itself
  EXPECT_EQ(sessions.count(), 2);
  sessions.SetWaiting(third.get(), false);
  EXPECT_FALSE(sessions.Add(fourth)) << "both are answered";
  EXPECT_EQ(sessions.refused(), 2);
  sessions.SetWaiting(first.get(), true);
  EXPECT_TRUE(sessions.Add(fourth));
  EXPECT_TRUE(first->closed);
  sessions.CloseAll();
  EXPECT_TRUE(third->closed && fourth->closed);
  EXPECT_FALSE(sessions.Add(std::make_shared<FakeSession>()));
}

TEST(SessionsTest, BodiesAreBookedTogether) {
  Sessions sessions(2, 100);
  EXPECT_TRUE(sessions.TakeBytes(60));
  EXPECT_FALSE(sessions.TakeBytes(41));
  EXPECT_FALSE(sessions.TakeBytes(~std::size_t{0}));
  EXPECT_TRUE(sessions.TakeBytes(40));
  sessions.GiveBytes(60);
  EXPECT_TRUE(sessions.TakeBytes(60));
}

}  // namespace
}  // namespace strata::server::web
