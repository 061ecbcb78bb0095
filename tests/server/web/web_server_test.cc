// The HTTP door on a real server: protocols, errors, who may call, and what hostile clients cannot.
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/common/retry_delay.h"
#include "server/web/wire.h"
#include "strata/v1/maps.grpc.pb.h"
#include "strata/v1/tiles.grpc.pb.h"
#include "tests/server/new_grant.h"
#include "tests/server/served_mock.h"
#include "tests/server/test_certificates.h"
#include "tests/server/web/http_client.h"
#include "tests/support/patience.h"
#include "tests/support/temp_dir.h"

namespace strata::server::web {
namespace {

using ::nlohmann::json;
using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::Return;
using ::testing::StartsWith;
using Code = absl::StatusCode;

const Headers kJson = {{"Content-Type", "application/json"}};
const Headers kJsonStream = {{"Content-Type", "application/connect+json"}};
constexpr char kGet[] = "/strata.v1.Maps/Get";
constexpr char kWatch[] = "/strata.v1.Maps/Watch";

// The envelopes of a stream's body: flags and bytes.
std::vector<std::pair<int, std::string>> Envelopes(std::string body) {
  std::vector<std::pair<int, std::string>> result;
  while (body.size() >= kEnvelopeBytes) {
    std::size_t size = 0;
    for (int i = 1; i < 5; ++i) size = size << 8 | static_cast<unsigned char>(body[i]);
    result.emplace_back(static_cast<unsigned char>(body[0]), body.substr(kEnvelopeBytes, size));
    body.erase(0, kEnvelopeBytes + size);
  }
  EXPECT_TRUE(body.empty());
  return result;
}

class WebServerTest : public ServedMock {
 protected:
  void ServeWeb(ServerOptions options = {}) {
    options.web_listen = "127.0.0.1:0";
    Serve(options);
    ASSERT_NE(server_, nullptr);
    url_ = server_->web_url();
    ASSERT_THAT(url_, StartsWith("http://127.0.0.1:"));
  }
  HttpAnswer Post(const std::string& path, const std::string& body, Headers headers = kJson) {
    return AskOnce(url_, "POST", path, headers, body);
  }
  HttpAnswer Get(const std::string& path, const Headers& headers = {}) {
    return AskOnce(url_, "GET", path, headers);
  }
  void AnswerMaps() {
    ON_CALL(db_.maps(), Get(_, _)).WillByDefault([](auto&, absl::string_view name) {
      MapInfo info;
      info.name = std::string(name);
      return absl::StatusOr<MapInfo>(info);
    });
  }
  void FailWith(const absl::Status& status) {
    ON_CALL(db_.maps(), Get(_, _)).WillByDefault(Return(status));
  }
  // A watch of a map that stands still.
  void StandStill() {
    ON_CALL(db_.maps(), Watch(_, _, _, _))
        .WillByDefault([](auto&, auto, const api::WatchOptions&, auto sink) {
          api::MapUpdate update;
          update.commit_sequence = 5;
          update.epoch = 3;
          return sink(update);
        });
  }

  testing::TempDir dir_;
  std::string url_;
};

TEST_F(WebServerTest, AUnaryCallIsAnsweredAsJsonAndAsBytes) {
  AnswerMaps();
  ServeWeb();
  const HttpAnswer answer = Post(kGet, R"({"name":"campus"})");
  EXPECT_EQ(answer.status, 200) << answer.body;
  EXPECT_EQ(answer.headers.at("content-type"), "application/json");
  EXPECT_FALSE(answer.headers.at("x-request-id").empty());
  EXPECT_EQ(json::parse(answer.body)["map"]["name"], "campus");
  v1::GetMapRequest request;
  request.set_name("campus");
  const HttpAnswer bytes =
      Post(kGet, request.SerializeAsString(), {{"Content-Type", "application/proto"}});
  v1::GetMapResponse response;
  ASSERT_TRUE(response.ParseFromString(bytes.body));
  EXPECT_EQ(response.map().name(), "campus");
}

TEST_F(WebServerTest, EveryErrorHasItsCodeItsMessageAndItsDetail) {
  ServeWeb();
  for (int code = 1; code <= 16; ++code) {
    FailWith(absl::Status(static_cast<Code>(code), "told \"so\""));
    const HttpAnswer answer = Post(kGet, R"({"name":"campus"})");
    const auto grpc_code = static_cast<grpc::StatusCode>(code);
    EXPECT_EQ(answer.status, HttpStatusOf(grpc_code)) << code;
    const json error = json::parse(answer.body);
    EXPECT_EQ(error["code"], std::string(CodeName(grpc_code)));
    EXPECT_EQ(error["message"], "told \"so\"");
    EXPECT_EQ(error["details"][0]["debug"]["reason"], "DATABASE");
    EXPECT_EQ(error["details"][0]["debug"]["metadata"]["request_id"],
              answer.headers.at("x-request-id"));
  }
  FailWith(WithRetryDelay(absl::UnavailableError("later"), absl::Milliseconds(1200)));
  EXPECT_EQ(Post(kGet, R"({"name":"campus"})").headers.at("retry-after"), "2");
}

TEST_F(WebServerTest, WrongRequestsAreToldWhatIsWrong) {
  ServeWeb();
  EXPECT_CALL(db_.maps(), Get(_, _)).Times(0);
  const HttpAnswer field = Post(kGet, R"({"nam":"campus"})");
  EXPECT_EQ(field.status, 400);
  EXPECT_EQ(json::parse(field.body)["code"], "invalid_argument");
  EXPECT_THAT(json::parse(field.body)["message"].get<std::string>(), HasSubstr("nam"));
  EXPECT_EQ(json::parse(field.body)["details"][0]["debug"]["reason"], "REQUEST");
  EXPECT_EQ(Post(kGet, "{").status, 400);
  EXPECT_EQ(Post(kGet, "\xff\xff", {{"Content-Type", "application/proto"}}).status, 400);
  EXPECT_EQ(Post("/strata.v1.Maps/Got", "{}").status, 404);
  EXPECT_EQ(Post("/strata.v1.Mops/Get", "{}").status, 404);
  EXPECT_EQ(Post("/grpc.health.v1.Health/Check", "{}").status, 404);
  EXPECT_EQ(Get("/nothing").status, 404);
  EXPECT_EQ(Get("/../../etc/passwd").status, 404);
  EXPECT_EQ(Get("/%2e%2e/%2e%2e/etc/passwd").status, 404);
  EXPECT_EQ(Get("//etc/passwd").status, 404);
  const HttpAnswer verb = Get(kGet);
  EXPECT_EQ(verb.status, 405);
  EXPECT_EQ(verb.headers.at("allow"), "POST");
  EXPECT_EQ(AskOnce(url_, "DELETE", "/healthz").status, 405);
  EXPECT_EQ(AskOnce(url_, "OPTIONS", kGet).status, 405);
  EXPECT_EQ(Post(kGet, "{}", {{"Content-Type", "text/plain"}}).status, 415);
  EXPECT_EQ(Post(kGet, "{}", {}).status, 415);
  EXPECT_EQ(
      Post(kGet, "{}", {{"Content-Type", "application/json"}, {"Content-Encoding", "gzip"}}).status,
      415);
  EXPECT_EQ(Post(kWatch, "{}").status, 415) << "a stream";
  EXPECT_EQ(Post("/strata.v1.Scans/Upload", "{}").status, 501) << "a stream of requests";
}

TEST_F(WebServerTest, ADeadlineEndsTheCall) {
  ON_CALL(db_.maps(), Get(_, _)).WillByDefault([](const api::Call& call, auto) {
    while (call.stop.status().ok()) absl::SleepFor(absl::Milliseconds(1));
    return absl::StatusOr<MapInfo>(call.stop.status());
  });
  ServeWeb();
  const HttpAnswer answer =
      Post(kGet,
           R"({"name":"campus"})",
           {{"Content-Type", "application/json"}, {"Connect-Timeout-Ms", "200"}});
  EXPECT_EQ(answer.status, 504);
  EXPECT_EQ(json::parse(answer.body)["code"], "deadline_exceeded");
  EXPECT_EQ(Post(kGet, "{}", {{"Content-Type", "application/json"}, {"Connect-Timeout-Ms", "soon"}})
                .status,
            400);
}

void FetchTwoTiles(::strata::testing::MockDatabase& db, absl::Status end) {
  ON_CALL(db.tiles(), Fetch(_, _, _, _, _))
      .WillByDefault([end](auto&, auto, auto&, auto&, auto sink) {
        for (std::uint64_t version = 1; version <= 2; ++version) {
          api::TileUpdate update;
          update.tile.version = version;
          update.tile.bytes = "tile";
          const absl::Status sent = sink(update);
          if (!sent.ok()) return sent;
        }
        return end;
      });
}

TEST_F(WebServerTest, AStreamComesInEnvelopesAndEndsWithItsStatus) {
  FetchTwoTiles(db_, absl::OkStatus());
  ServeWeb();
  const auto fetch = [this] {
    const HttpAnswer answer =
        Post("/strata.v1.Tiles/Fetch", Envelope(0, R"({"map":"campus"})"), kJsonStream);
    EXPECT_EQ(answer.status, 200);
    EXPECT_EQ(answer.headers.at("content-type"), "application/connect+json");
    return Envelopes(answer.body);
  };
  auto pieces = fetch();
  ASSERT_EQ(pieces.size(), 3);
  EXPECT_EQ(json::parse(pieces[1].second)["tile"]["version"], "2");
  EXPECT_EQ(json::parse(pieces[1].second)["tile"]["bytes"], "dGlsZQ==");
  EXPECT_EQ(pieces[2], std::make_pair(2, std::string("{}")));
  FetchTwoTiles(db_, absl::DataLossError("tile 2 is damaged"));
  pieces = fetch();
  ASSERT_EQ(pieces.size(), 3);
  EXPECT_EQ(pieces[2].first, 2);
  EXPECT_EQ(json::parse(pieces[2].second)["error"]["code"], "data_loss");
  const auto refused = Envelopes(Post("/strata.v1.Tiles/Fetch", "{}", kJsonStream).body);
  ASSERT_EQ(refused.size(), 1);
  EXPECT_EQ(json::parse(refused[0].second)["error"]["code"], "invalid_argument");
}

TEST_F(WebServerTest, GrpcWebHasUnaryCallsAndStreamsWithTrailers) {
  AnswerMaps();
  FetchTwoTiles(db_, absl::NotFoundError("gone"));
  ServeWeb();
  const Headers web = {{"Content-Type", "application/grpc-web+proto"}, {"X-Grpc-Web", "1"}};
  v1::GetMapRequest request;
  request.set_name("campus");
  auto pieces = Envelopes(Post(kGet, Envelope(0, request.SerializeAsString()), web).body);
  ASSERT_EQ(pieces.size(), 2);
  v1::GetMapResponse response;
  EXPECT_TRUE(response.ParseFromString(pieces[0].second));
  EXPECT_EQ(response.map().name(), "campus");
  EXPECT_EQ(pieces[1], std::make_pair(0x80, std::string("grpc-status: 0\r\n")));
  v1::FetchTilesRequest fetch;
  fetch.set_map("campus");
  pieces =
      Envelopes(Post("/strata.v1.Tiles/Fetch", Envelope(0, fetch.SerializeAsString()), web).body);
  ASSERT_EQ(pieces.size(), 3);
  EXPECT_THAT(pieces[2].second, StartsWith("grpc-status: 5\r\ngrpc-message: gone\r\n"));
  EXPECT_THAT(pieces[2].second, HasSubstr("grpc-status-details-bin: "));
}

TEST_F(WebServerTest, ATileIsCachedByItsVersion) {
  ON_CALL(db_.tiles(), Get(_, _, _)).WillByDefault([](auto&, auto map, const TileKey& key) {
    EXPECT_EQ(map, "campus");
    EXPECT_EQ(key.x, -3);
    return absl::StatusOr<api::EncodedTile>(
        api::EncodedTile{.key = key, .version = 42, .epoch = 7, .bytes = "SST1"});
  });
  ServeWeb();
  const HttpAnswer tile = Get("/v1/maps/campus/tiles/0/-3/5");
  EXPECT_EQ(tile.status, 200) << tile.body;
  EXPECT_EQ(tile.body, "SST1");
  EXPECT_EQ(tile.headers.at("x-strata-version"), "42");
  EXPECT_EQ(tile.headers.at("cache-control"), "private, no-cache");
  const std::string etag = tile.headers.at("etag");
  EXPECT_THAT(etag, StartsWith("\"42-"));
  const HttpAnswer same = Get("/v1/maps/campus/tiles/0/-3/5", {{"If-None-Match", etag}});
  EXPECT_EQ(same.status, 304);
  EXPECT_EQ(same.body, "");
  EXPECT_EQ(same.headers.at("etag"), etag);
  EXPECT_EQ(Get("/v1/maps/campus/tiles/0/-3/5", {{"If-None-Match", "\"41-0\", W/" + etag}}).status,
            304);
  EXPECT_EQ(Get("/v1/maps/campus/tiles/0/-3/5", {{"If-None-Match", "\"41-0\""}}).status, 200);
  EXPECT_THAT(Get("/v1/maps/campus/tiles/0/-3/5?v=42").headers.at("cache-control"),
              HasSubstr("immutable"));
  EXPECT_EQ(Get("/v1/maps/campus/tiles/0/-3/5?v=41").headers.at("cache-control"),
            "private, no-cache");
  EXPECT_EQ(Get("/v1/maps/campus/tiles/99/-3/5").status, 400);
  const HttpAnswer head = AskOnce(url_, "HEAD", "/v1/maps/campus/tiles/0/-3/5");
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.headers.at("content-length"), "4");
}

TEST_F(WebServerTest, AConnectionServesOneRequestAfterTheOther) {
  AnswerMaps();
  ServeWeb();
  HttpConnection connection(url_);
  for (int i = 0; i < 3; ++i) {
    connection.Ask("POST", kGet, kJson, R"({"name":"campus"})");
    EXPECT_EQ(connection.Take().status, 200);
  }
  // The next is there before the answer is.
  connection.Ask("POST", kGet, kJson, R"({"name":"one"})");
  connection.Ask("POST", kGet, kJson, R"({"name":"two"})");
  EXPECT_THAT(connection.Take().body, HasSubstr("one"));
  EXPECT_THAT(connection.Take().body, HasSubstr("two"));
}

TEST_F(WebServerTest, PagesSayWhatBrowsersMayDoWithThem) {
  ServeWeb();
  const HttpAnswer page = Get("/");
  EXPECT_EQ(page.status, 200);
  EXPECT_THAT(page.body, HasSubstr("viewer is not installed"));
  for (const HttpAnswer& answer : {page, Get("/openapi.json"), Get("/nothing"), Post(kGet, "{")}) {
    EXPECT_THAT(answer.headers.at("content-security-policy"), StartsWith("default-src 'self'"));
    EXPECT_EQ(answer.headers.at("x-content-type-options"), "nosniff");
    EXPECT_EQ(answer.headers.count("access-control-allow-origin"), 0);
  }
  EXPECT_EQ(json::parse(Get("/openapi.json").body)["openapi"], "3.1.0");
  const HttpAnswer health = Get("/healthz");
  EXPECT_EQ(health.status, 200);
  EXPECT_EQ(health.body, R"({"status":"SERVING"})");
}

TEST_F(WebServerTest, TheViewerIsAFixedTableOfFiles) {
  for (const char* file :
       {"index.html", "viewer.js", "worker.js", "viewer.css", "icon.svg", "secret.txt"}) {
    std::ofstream(dir_.path() / file) << file;
  }
  ServerOptions options;
  options.web_viewer = dir_.path();
  ServeWeb(options);
  EXPECT_EQ(Get("/").body, "index.html");
  const HttpAnswer script = Get("/viewer.js");
  EXPECT_EQ(script.body, "viewer.js");
  EXPECT_EQ(script.headers.at("content-type"), "text/javascript");
  EXPECT_EQ(Get("/viewer.js", {{"If-None-Match", script.headers.at("etag")}}).status, 304);
  EXPECT_EQ(Get("/secret.txt").status, 404);
  std::filesystem::remove(dir_.path() / "icon.svg");
  options.listen = "127.0.0.1:0";
  options.web_listen = "127.0.0.1:0";
  EXPECT_THAT(Server::Start(db_, options), StatusIs(Code::kNotFound, HasSubstr("icon.svg")));
}

TEST_F(WebServerTest, TheViewerComesPackedToWhoTakesIt) {
  for (const char* file :
       {"index.html", "viewer.js", "viewer.js.gz", "worker.js", "viewer.css", "icon.svg"}) {
    std::ofstream(dir_.path() / file) << file;
  }
  ServerOptions options;
  options.web_viewer = dir_.path();
  ServeWeb(options);
  for (const char* takes : {"gzip", "gzip, deflate, br, zstd", "br;q=1.0, GZIP;q=0.5, *;q=0"}) {
    const HttpAnswer script = Get("/viewer.js", {{"Accept-Encoding", takes}});
    EXPECT_EQ(script.body, "viewer.js.gz") << takes;
    EXPECT_EQ(script.headers.at("content-encoding"), "gzip") << takes;
    EXPECT_EQ(script.headers.at("content-type"), "text/javascript");
    EXPECT_EQ(script.headers.at("vary"), "Accept-Encoding");
  }
  for (const char* takes : {"identity", "br", "gzip;q=0", "gzip; q=0.000", "gzip;q=x", "xgzip"}) {
    const HttpAnswer script = Get("/viewer.js", {{"Accept-Encoding", takes}});
    EXPECT_EQ(script.body, "viewer.js") << takes;
    EXPECT_EQ(script.headers.count("content-encoding"), 0) << takes;
    EXPECT_EQ(script.headers.at("vary"), "Accept-Encoding");
  }
  EXPECT_EQ(Get("/viewer.css", {{"Accept-Encoding", "gzip"}}).body, "viewer.css");
  // Each has an ETag of its own.
  const Headers gzip = {{"Accept-Encoding", "gzip"}};
  const std::string etag = Get("/viewer.js", gzip).headers.at("etag");
  EXPECT_EQ(Get("/viewer.js", {gzip[0], {"If-None-Match", etag}}).status, 304);
  EXPECT_EQ(Get("/viewer.js", {{"If-None-Match", etag}}).status, 200);
}

TEST_F(WebServerTest, PagesOfOthersReachNothing) {
  ServerOptions options;
  options.web_names = {"maps.example"};
  EXPECT_CALL(db_.maps(), Delete(_, _)).Times(0);
  ServeWeb(options);
  AnswerMaps();
  const auto with = [this](Headers headers) {
    headers.emplace_back("Content-Type", "application/json");
    return Post(kGet, R"({"name":"campus"})", headers).status;
  };
  const std::string host = url_.substr(7);
  EXPECT_EQ(with({{"Origin", url_}}), 200);
  EXPECT_EQ(with({{"Host", "maps.example"}, {"Origin", "https://maps.example"}}), 200);
  EXPECT_EQ(with({{"Host", "evil.example"}}), 403) << "its name may point here";
  EXPECT_EQ(with({{"Host", "evil.example"}, {"Origin", "http://evil.example"}}), 403);
  EXPECT_EQ(with({{"Host", host}, {"Host", "evil.example"}}), 403);
  EXPECT_EQ(with({{"Origin", "http://evil.example"}}), 403);
  EXPECT_EQ(with({{"Origin", "http://127.0.0.1:1"}}), 403) << "another server of this machine";
  EXPECT_EQ(with({{"Origin", "null"}}), 403);
  EXPECT_EQ(with({{"Sec-Fetch-Site", "cross-site"}}), 403);
  EXPECT_EQ(Get("/healthz", {{"Host", "evil.example"}}).status, 403);
  EXPECT_EQ(Get("/", {{"Sec-Fetch-Site", "cross-site"}, {"Sec-Fetch-Mode", "navigate"}}).status,
            200);
  EXPECT_EQ(Get("/", {{"Sec-Fetch-Site", "cross-site"}, {"Sec-Fetch-Mode", "no-cors"}}).status,
            403);
  HttpConnection old(url_);
  old.Say("GET /healthz HTTP/1.0\r\n\r\n");
  EXPECT_EQ(old.Take().status, 403) << "no host at all";
}

TEST_F(WebServerTest, TokensAreAskedForAndNothingElse) {
  const auto [reader, token] = NewGrant("reader", {{"campus", Right::kRead}});
  const std::filesystem::path file = dir_.path() / "tokens.json";
  AddToFile(file, reader);
  ServerOptions options;
  options.token_file = file;
  ServeWeb(options);
  AnswerMaps();
  EXPECT_CALL(db_.maps(), Delete(_, _)).Times(0);
  const auto ask = [this](const std::string& path, const std::string& authorization) {
    return Post(path,
                R"({"name":"campus"})",
                {{"Content-Type", "application/json"}, {"Authorization", authorization}});
  };
  const HttpAnswer nobody = Post(kGet, R"({"name":"campus"})");
  EXPECT_EQ(nobody.status, 401);
  EXPECT_EQ(nobody.headers.at("www-authenticate"), "Bearer");
  EXPECT_EQ(ask(kGet, "Bearer " + token).status, 200);
  EXPECT_EQ(ask(kGet, "Bearer wrong").status, 401);
  EXPECT_EQ(ask(kGet, "Bearer \xff").status, 401) << "no metadata of gRPC";
  const HttpAnswer denied = ask("/strata.v1.Maps/Delete", "Bearer " + token);
  EXPECT_EQ(denied.status, 403);
  EXPECT_THAT(json::parse(denied.body)["message"].get<std::string>(), HasSubstr("admin"));
  EXPECT_EQ(Get("/v1/maps/campus/tiles/0/0/0").status, 401);
  EXPECT_EQ(Get("/healthz").status, 200) << "health is for anybody";
  // What is no stranger's to send.
  HttpConnection large(url_);
  large.Say(absl::StrCat("POST ",
                         kGet,
                         " HTTP/1.1\r\nHost: localhost\r\n",
                         "Content-Type: application/json\r\nContent-Length: 1000000\r\n\r\n"));
  EXPECT_EQ(large.Take().status, 401);
}

TEST_F(WebServerTest, ACallIsThatOfItsAddressAndNobodySaysAnother) {
  AnswerMaps();
  ServerOptions options;
  options.client.calls_per_second = 0.001;
  options.client.burst = 2;
  ServeWeb(options);
  const auto by_grpc = [this](const std::string& peer) {
    grpc::ClientContext context;
    context.AddMetadata("x-strata-web-peer", peer);
    v1::GetMapRequest in;
    in.set_name("campus");
    v1::GetMapResponse out;
    return Call<v1::Maps>(&v1::Maps::Stub::Get, in, &out, &context);
  };
  const auto by_web = [this](const std::string& peer) {
    return Post(kGet,
                R"({"name":"campus"})",
                {{"Content-Type", "application/json"}, {"X-Strata-Web-Peer", peer}})
        .status;
  };
  EXPECT_THAT(by_grpc("ipv4:192.0.2.1:1"), IsOk());
  EXPECT_EQ(by_web("ipv4:192.0.2.2:1"), 200);
  EXPECT_THAT(by_grpc("ipv4:192.0.2.3:1"), StatusIs(Code::kResourceExhausted, _));
  EXPECT_EQ(by_web("ipv4:192.0.2.4:1"), 429);
}

TEST_F(WebServerTest, AClosedTabFreesItsStream) {
  StandStill();
  ServerOptions options;
  options.client.max_watches = 1;
  ServeWeb(options);
  const auto watch = [](HttpConnection& connection, absl::string_view until) {
    connection.Ask("POST", kWatch, kJsonStream, Envelope(0, R"({"name":"campus"})"));
    return connection.TakeUntil(until);
  };
  {
    HttpConnection tab(url_);
    EXPECT_THAT(watch(tab, "commit_sequence"), HasSubstr("commit_sequence"));
    HttpConnection second(url_);
    EXPECT_THAT(watch(second, "resource_exhausted"), HasSubstr("resource_exhausted"))
        << "one watch a client";
  }
  // Now another may.
  std::string said;
  const absl::Time until = absl::Now() + testing::kPatience;
  while (absl::Now() < until && said.find("commit_sequence") == std::string::npos) {
    HttpConnection next(url_);
    said = watch(next, "}");
  }
  EXPECT_THAT(said, HasSubstr("commit_sequence"));
}

TEST_F(WebServerTest, AClosedConnectionEndsTheSearchItAskedFor) {
  absl::Notification begun;
  absl::Notification stopped;
  ON_CALL(db_.maps(), Get(_, _)).WillByDefault([&](const api::Call& call, auto) {
    begun.Notify();
    while (call.stop.status().ok()) absl::SleepFor(absl::Milliseconds(1));
    stopped.Notify();
    return absl::StatusOr<MapInfo>(call.stop.status());
  });
  ServeWeb();
  {
    HttpConnection connection(url_);
    connection.Ask("POST", kGet, kJson, R"({"name":"campus"})");
    ASSERT_TRUE(begun.WaitForNotificationWithTimeout(testing::kPatience));
  }
  EXPECT_TRUE(stopped.WaitForNotificationWithTimeout(testing::kPatience));
}

TEST_F(WebServerTest, HugeBodiesAndHeadersAreRefusedBeforeTheyAreRead) {
  ServerOptions options;
  options.max_message_bytes = 64 << 10;
  ServeWeb(options);
  const std::string head = absl::StrCat(
      "POST ", kGet, " HTTP/1.1\r\nHost: localhost\r\n", "Content-Type: application/json\r\n");
  const auto said = [this](const std::string& text) {
    HttpConnection connection(url_);
    connection.Say(text);
    const HttpAnswer answer = connection.Take();
    EXPECT_TRUE(connection.IsClosed());
    return answer.status;
  };
  EXPECT_EQ(said(head + "Content-Length: 99999999999\r\n\r\n"), 413);
  EXPECT_EQ(said(head + "Content-Length: 18446744073709551616\r\n\r\n"), 400);
  EXPECT_EQ(said(head + "Content-Length: -1\r\n\r\n"), 400);
  EXPECT_EQ(said(head + "Content-Length: 2\r\nTransfer-Encoding: chunked\r\n\r\n"), 400);
  EXPECT_EQ(said(head + "X-Large: " + std::string(20'000, 'x') + "\r\n\r\n"), 431);
  EXPECT_EQ(said("nonsense\r\n\r\n"), 400);
  EXPECT_EQ(said(head + "X Y: bad\r\n\r\n"), 400);
  std::string chunks = head + "Transfer-Encoding: chunked\r\n\r\n";
  for (int i = 0; i < 20; ++i) chunks += "2000\r\n" + std::string(0x2000, ' ') + "\r\n";
  EXPECT_EQ(said(chunks), 413);
  EXPECT_EQ(said(head + "Transfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n"), 413);
}

TEST_F(WebServerTest, HalfOpenConnectionsStopNobody) {
  AnswerMaps();
  ServerOptions options;
  options.max_calls = 100;
  options.max_watches = 50;  // 150 connections
  ServeWeb(options);
  std::vector<std::unique_ptr<HttpConnection>> half_open;
  for (int i = 0; i < 200; ++i) {
    half_open.push_back(std::make_unique<HttpConnection>(url_));
    if (i % 2 == 0) half_open.back()->Say("POST /strata.v1.Maps/Get HTTP/1.1\r\nHost: loc");
  }
  EXPECT_EQ(Post(kGet, R"({"name":"campus"})").status, 200);
  EXPECT_TRUE(half_open.front()->IsClosed()) << "it made room";
}

TEST_F(WebServerTest, AnswersThatNobodyTakesAreBounded) {
  constexpr std::size_t kTileBytes = 8 << 20;
  ON_CALL(db_.tiles(), Get(_, _, _)).WillByDefault([](auto&, auto, const TileKey& key) {
    return absl::StatusOr<api::EncodedTile>(
        api::EncodedTile{.key = key, .version = 1, .bytes = std::string(kTileBytes, 'x')});
  });
  ServerOptions options;
  options.max_call_bytes = 5 * kTileBytes;
  ServeWeb(options);
  // One more each time: one that asks beside the test may be the one that is refused, and holds
  // nothing then.
  std::vector<std::unique_ptr<HttpConnection>> idle;
  HttpAnswer refused;
  for (const absl::Time until = absl::Now() + testing::kPatience;
       refused.status != 429 && absl::Now() < until;) {
    idle.push_back(std::make_unique<HttpConnection>(url_, 4096));
    idle.back()->Ask("GET", "/v1/maps/campus/tiles/0/0/0");
    refused = Get("/v1/maps/campus/tiles/0/0/0");
  }
  ASSERT_EQ(refused.status, 429);
  EXPECT_EQ(json::parse(refused.body)["details"][0]["debug"]["reason"], "SERVER_BUSY");
  EXPECT_EQ(Get("/healthz").status, 200);
  idle.clear();
  const absl::Time until = absl::Now() + testing::kPatience;
  int status = 0;
  while (status != 200 && absl::Now() < until) {
    status = Get("/v1/maps/campus/tiles/0/0/0").status;
  }
  EXPECT_EQ(status, 200);
}

TEST_F(WebServerTest, SlowHeadersAndBodiesEnd) {
  ServerOptions options;
  options.slow_sender_timeout = absl::Milliseconds(300);
  ServeWeb(options);
  HttpConnection body(url_);
  body.Say(absl::StrCat("POST ",
                        kGet,
                        " HTTP/1.1\r\nHost: localhost\r\n",
                        "Content-Type: application/json\r\nContent-Length: 100\r\n\r\n{"));
  EXPECT_TRUE(body.IsClosed());
  // A letter every second does not keep the header's time from running out (10 s).
  HttpConnection header(url_);
  const absl::Time begun = absl::Now();
  header.Say("POST /strata.v1.Maps/Get HTTP/1.1\r\nX-Slow: ");
  bool closed = false;
  while (!closed && absl::Now() - begun < testing::kPatience) {
    header.Say("x");
    closed = header.IsClosed(absl::Seconds(1));
  }
  EXPECT_TRUE(closed);
  EXPECT_GT(absl::Now() - begun, absl::Seconds(8));
}

TEST_F(WebServerTest, ShutdownEndsWatchesWithTheReason) {
  StandStill();
  ServeWeb();
  HttpConnection tab(url_);
  tab.Ask("POST", kWatch, kJsonStream, Envelope(0, R"({"name":"campus"})"));
  EXPECT_THAT(tab.TakeUntil("commit_sequence"), HasSubstr("commit_sequence"));
  server_->Shutdown();
  EXPECT_THAT(tab.TakeUntil("SHUTTING_DOWN"), HasSubstr("SHUTTING_DOWN"));
  EXPECT_TRUE(tab.IsClosed());
  EXPECT_EQ(HttpConnection(url_).Say("x"), false);
}

TEST_F(WebServerTest, CurlSpeaksToItByTls) {
  if (std::system("curl --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "curl is not installed";
  const ::strata::testing::TestAuthority authority(dir_.path(), "ca");
  const auto issued = authority.Issue("server", "maps.example");
  ServerOptions options;
  options.tls = {issued.certificate, issued.key, ""};
  options.web_listen = "127.0.0.1:0";
  AnswerMaps();
  Serve(options);
  ASSERT_THAT(server_->web_url(), StartsWith("https://127.0.0.1:"));
  const std::filesystem::path out = dir_.path() / "out";
  const auto curl = [&](const std::string& rest) {
    return std::system(absl::StrCat("curl -sS --max-time 60 --cacert ",
                                    authority.certificate().string(),
                                    " -o ",
                                    out.string(),
                                    " ",
                                    rest,
                                    " 2> ",
                                    (dir_.path() / "errors").string())
                           .c_str());
  };
  const auto text = [&] {
    std::ifstream in(out);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  ASSERT_EQ(curl(server_->web_url() + "/healthz"), 0);
  EXPECT_EQ(text(), R"({"status":"SERVING"})");
  ASSERT_EQ(curl(absl::StrCat("-H 'content-type: application/json' -d '{\"name\":\"campus\"}' ",
                              server_->web_url(),
                              kGet)),
            0);
  EXPECT_THAT(text(), HasSubstr("campus"));
  EXPECT_NE(curl("--tls-max 1.1 " + server_->web_url() + "/healthz"), 0);
  // Another certificate is taken up, also one that curl does not know.
  const ::strata::testing::TestAuthority stranger(dir_.path(), "stranger");
  stranger.Issue("server", "maps.example");
  const absl::Time until = absl::Now() + testing::kPatience;
  while (absl::Now() < until && curl(server_->web_url() + "/healthz") == 0) {
    absl::SleepFor(absl::Milliseconds(500));
  }
  EXPECT_NE(curl(server_->web_url() + "/healthz"), 0);
}

TEST_F(WebServerTest, TheAddressIsUnderTheSameRulesAsThatOfGrpc) {
  ServerOptions options;
  options.web_listen = "0.0.0.0:0";
  EXPECT_THAT(CheckExposure(options), StatusIs(Code::kFailedPrecondition, HasSubstr("0.0.0.0:0")));
  options.insecure = true;
  EXPECT_THAT(CheckExposure(options), IsOk());
  options.web_listen = "nowhere";
  EXPECT_THAT(CheckExposure(options), StatusIs(Code::kInvalidArgument, _));
}

}  // namespace
}  // namespace strata::server::web
