#include "server/web/pages.h"

#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include <xxhash.h>

#include "core/common/status.h"
#include "proto/translate/status.h"
#include "server/rpc/request.h"
#include "server/web/openapi.h"
#include "server/web/rpc.h"
#include "strata/v1/tiles.pb.h"

namespace strata::server::web {
namespace {

namespace fs = std::filesystem;

constexpr char kHealthPath[] = "/healthz";
constexpr char kOpenApiPath[] = "/openapi.json";
constexpr char kHealthCheck[] = "/grpc.health.v1.Health/Check";
constexpr char kTileGet[] = "/strata.v1.Tiles/Get";
// A HealthCheckRequest for strata.v1.Maps, which serves while nothing keeps the server from its
// work; and the byte that SERVING is in the answer.
constexpr absl::string_view kHealthRequest("\x0a\x0estrata.v1.Maps", 16);
constexpr absl::string_view kServing("\x08\x01", 2);
constexpr std::uintmax_t kMostFileBytes = 16 << 20;

struct Asset {
  const char* path;
  const char* file;
  const char* type;
};
constexpr std::array<Asset, 5> kAssets = {{{"/", "index.html", "text/html; charset=utf-8"},
                                           {"/viewer.js", "viewer.js", "text/javascript"},
                                           {"/worker.js", "worker.js", "text/javascript"},
                                           {"/viewer.css", "viewer.css", "text/css"},
                                           {"/icon.svg", "icon.svg", "image/svg+xml"}}};

constexpr char kNoViewer[] =
    "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Strata</title>"
    "<h1>Strata</h1><p>This server answers, but its viewer is not installed.</p>"
    "<p>Build it where npm is (<code>cmake --build --preset release --target viewer</code>) and "
    "start <code>stratad</code> with <code>--web-viewer DIR</code>; see docs/web.md.</p>"
    "<p>The API: <a href=\"/openapi.json\">/openapi.json</a>.</p></html>";

std::string TagOf(absl::string_view bytes) {
  return absl::StrCat(absl::Hex(XXH3_64bits(bytes.data(), bytes.size()), absl::kZeroPad16));
}

absl::StatusOr<std::string> ReadAsset(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error) return absl::NotFoundError(absl::StrCat(file.string(), ": ", error.message()));
  if (size > kMostFileBytes) {
    return absl::ResourceExhaustedError(absl::StrCat(file.string(), " has ", size, " bytes"));
  }
  std::ifstream in(file, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(in), {});
}

// What the viewer's build packed by gzip; empty where it did not.
absl::StatusOr<std::string> ReadPacked(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return std::string();
  return ReadAsset(file);
}

// Whether Accept-Encoding has gzip, with a weight above 0.
bool TakesGzip(const Question& question) {
  for (const absl::string_view coding : absl::StrSplit(question.Header("accept-encoding"), ',')) {
    const std::pair<absl::string_view, absl::string_view> parts =
        absl::StrSplit(coding, absl::MaxSplits(';', 1));
    if (!absl::EqualsIgnoreCase(absl::StripAsciiWhitespace(parts.first), "gzip")) continue;
    absl::string_view weight = absl::StripAsciiWhitespace(parts.second);
    if (weight.empty()) return true;
    double value = 0.0;
    return absl::ConsumePrefix(&weight, "q=") && absl::SimpleAtod(weight, &value) && value > 0.0;
  }
  return false;
}

// Whether If-None-Match has `etag`, which is one with its quotes.
bool Holds(const Question& question, absl::string_view etag) {
  for (absl::string_view held : absl::StrSplit(question.Header("if-none-match"), ',')) {
    held = absl::StripAsciiWhitespace(held);
    absl::ConsumePrefix(&held, "W/");
    if (held == etag || held == "*") return true;
  }
  return false;
}

// The value of `name` in the query; empty without it.
absl::string_view InQuery(const Question& question, absl::string_view name) {
  for (const absl::string_view pair : absl::StrSplit(question.query, '&')) {
    const std::pair<absl::string_view, absl::string_view> parts =
        absl::StrSplit(pair, absl::MaxSplits('=', 1));
    if (parts.first == name) return parts.second;
  }
  return "";
}

std::optional<std::string> PercentDecoded(absl::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      result += text[i];
      continue;
    }
    unsigned int value = 0;
    if (i + 3 > text.size() || !absl::SimpleHexAtoi(text.substr(i + 1, 2), &value)) {
      return std::nullopt;
    }
    result += static_cast<char>(value);
    i += 2;
  }
  return result;
}

Answer WithTag(const Question& question, std::string etag, const std::string& cache, Answer full) {
  full.headers.emplace_back("ETag", etag);
  full.headers.emplace_back("Cache-Control", cache);
  if (Holds(question, etag)) {
    full.status = 304;
    full.body.clear();
  }
  return full;
}

// A tile that was asked for by its version never changes, and no other does by that URL.
Answer TileAnswer(const Question& question, const std::string& bytes) {
  v1::GetTileResponse response;
  if (!response.ParseFromString(bytes)) {
    return ErrorAnswer(500, grpc::INTERNAL, "the answer is no GetTileResponse");
  }
  v1::EncodedTile& tile = *response.mutable_tile();
  const std::string version = absl::StrCat(tile.version());
  const std::string etag = absl::StrCat("\"", version, "-", TagOf(tile.bytes()), "\"");
  const bool named = InQuery(question, "v") == version;
  Answer answer{200,
                {{"Content-Type", "application/octet-stream"},
                 {"X-Strata-Version", version},
                 {"X-Strata-Epoch", absl::StrCat(tile.epoch())}},
                std::move(*tile.mutable_bytes())};
  return WithTag(question,
                 etag,
                 named ? "private, max-age=31536000, immutable" : "private, no-cache",
                 std::move(answer));
}

Answer HealthAnswer(bool serving) {
  return {serving ? 200 : 503,
          {{"Content-Type", "application/json"}, {"Cache-Control", "no-store"}},
          serving ? R"({"status":"SERVING"})" : R"({"status":"NOT_SERVING"})"};
}

}  // namespace

std::optional<TilePath> ParseTilePath(absl::string_view path) {
  const std::vector<absl::string_view> parts = absl::StrSplit(path, '/');
  if (parts.size() != 8 || !parts[0].empty() || parts[1] != "v1" || parts[2] != "maps" ||
      parts[4] != "tiles") {
    return std::nullopt;
  }
  TilePath tile;
  std::optional<std::string> map = PercentDecoded(parts[3]);
  if (!map.has_value() || !absl::SimpleAtoi(parts[5], &tile.level) ||
      !absl::SimpleAtoi(parts[6], &tile.x) || !absl::SimpleAtoi(parts[7], &tile.y)) {
    return std::nullopt;
  }
  tile.map = *std::move(map);
  return tile;
}

absl::StatusOr<std::unique_ptr<Pages>> Pages::Make(const fs::path& viewer,
                                                   const Contract& contract,
                                                   grpc::GenericStub& stub,
                                                   CallCount& count) {
  std::unique_ptr<Pages> pages(new Pages(stub, count));
  pages->openapi_ = OpenApiOf(contract);
  if (viewer.empty()) {
    pages->files_["/"] = {kAssets[0].type, {kNoViewer, ""}, {}};
    return pages;
  }
  for (const Asset& asset : kAssets) {
    STRATA_ASSIGN_OR_RETURN(std::string body, ReadAsset(viewer / asset.file));
    STRATA_ASSIGN_OR_RETURN(std::string packed,
                            ReadPacked(viewer / absl::StrCat(asset.file, ".gz")));
    std::string etag = absl::StrCat("\"", TagOf(body), "\"");
    std::string packed_etag = absl::StrCat("\"", TagOf(packed), "\"");
    pages->files_[asset.path] = {asset.type,
                                 {std::move(body), std::move(etag)},
                                 {std::move(packed), std::move(packed_etag)}};
  }
  return pages;
}

bool Pages::Has(absl::string_view path) const {
  return files_.contains(path) || path == kHealthPath || path == kOpenApiPath ||
         ParseTilePath(path).has_value();
}

std::shared_ptr<Exchange> Pages::Handle(const Question& question,
                                        const std::shared_ptr<AnswerSink>& sink) const {
  if (question.path == kHealthPath) return HandleHealth(question, sink);
  if (const auto tile = ParseTilePath(question.path); tile.has_value()) {
    return HandleTile(question, *tile, sink);
  }
  if (question.path == kOpenApiPath) {
    sink->Send({200, {{"Content-Type", "application/json"}}, openapi_});
    return nullptr;
  }
  const File& file = files_.find(question.path)->second;
  const bool packed = !file.packed.body.empty() && TakesGzip(question);
  const Bytes& bytes = packed ? file.packed : file.plain;
  Answer answer{200, {{"Content-Type", file.type}, {"Vary", "Accept-Encoding"}}, bytes.body};
  if (packed) answer.headers.emplace_back("Content-Encoding", "gzip");
  sink->Send(WithTag(question, bytes.etag, "no-cache", std::move(answer)));
  return nullptr;
}

std::shared_ptr<Exchange> Pages::HandleTile(const Question& question,
                                            const TilePath& tile,
                                            const std::shared_ptr<AnswerSink>& sink) const {
  const absl::StatusOr<CallHead> head = CallHeadOf(question, kTileGet);
  if (!head.ok()) {
    sink->Send(ErrorAnswer(translate::ToGrpcStatus(
        translate::WithReason(head.status(), translate::kRequestReason), "")));
    return nullptr;
  }
  v1::GetTileRequest request;
  request.set_map(tile.map);
  request.mutable_key()->set_level(tile.level);
  request.mutable_key()->set_x(tile.x);
  request.mutable_key()->set_y(tile.y);
  return Begin(
      *head,
      request.SerializeAsString(),
      [question](const std::string& bytes) { return TileAnswer(question, bytes); },
      [](const grpc::Status& status) { return ErrorAnswer(status); },
      sink);
}

std::shared_ptr<Exchange> Pages::HandleHealth(const Question& question,
                                              const std::shared_ptr<AnswerSink>& sink) const {
  CallHead head;
  head.path = kHealthCheck;
  head.peer = question.peer;
  head.timeout = absl::Seconds(5);
  return Begin(
      head,
      std::string(kHealthRequest),
      [](const std::string& bytes) { return HealthAnswer(bytes == kServing); },
      [](const grpc::Status& /*status*/) { return HealthAnswer(false); },
      sink);
}

std::shared_ptr<Exchange> Pages::Begin(const CallHead& head,
                                       const std::string& request,
                                       std::function<Answer(const std::string& bytes)> answer,
                                       std::function<Answer(const grpc::Status& status)> error,
                                       const std::shared_ptr<AnswerSink>& sink) const {
  const auto bytes = std::make_shared<std::string>();
  const auto call = std::make_shared<std::weak_ptr<OutgoingCall>>();
  CallEvents events;
  events.on_message = [bytes, call](std::string message) {
    *bytes = std::move(message);
    if (const auto held = call->lock()) held->ReadNext();
  };
  events.on_end = [bytes, sink, answer = std::move(answer), error = std::move(error)](
                      const grpc::Status& status, const std::string& request_id) {
    Answer reply = status.ok() ? answer(*bytes) : error(status);
    if (!request_id.empty()) reply.headers.emplace_back(kRequestIdKey, request_id);
    sink->Send(std::move(reply));
  };
  const auto made = OutgoingCall::Make(count_, head, request, std::move(events));
  *call = made;
  made->Start(stub_);
  return made;
}

}  // namespace strata::server::web
