// What is read by GET: the viewer, tiles, health, and the contract as OpenAPI.
#ifndef STRATA_SERVER_WEB_PAGES_H_
#define STRATA_SERVER_WEB_PAGES_H_

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <grpcpp/generic/generic_stub.h>

#include "server/web/call.h"
#include "server/web/contract.h"
#include "server/web/exchange.h"

namespace strata::server::web {

// A tile as a path names it: /v1/maps/MAP/tiles/LEVEL/X/Y.
struct TilePath {
  std::string map;
  int level = 0;
  std::int32_t x = 0;
  std::int32_t y = 0;
};
// nullopt for any other path. Of the map's name "%xx" is resolved.
std::optional<TilePath> ParseTilePath(absl::string_view path);

// A table of paths made when the server starts: no path of a client's reaches a disk. Thread-safe.
class Pages {
 public:
  // `viewer`: the folder that the viewer's files are read from, once; where it has none, "/" says
  // how to get it. Empty: none. NOT_FOUND: a folder without the viewer; RESOURCE_EXHAUSTED: a file
  // of more than 16 MiB.
  static absl::StatusOr<std::unique_ptr<Pages>> Make(const std::filesystem::path& viewer,
                                                     const Contract& contract,
                                                     grpc::GenericStub& stub,
                                                     CallCount& count);

  // Whether something is read by GET at `path`.
  bool Has(absl::string_view path) const;
  // Whether it is the viewer's: a page of another site may lead to it.
  bool IsViewer(absl::string_view path) const { return files_.contains(path); }
  // Of a path that it has. Null: answered at once.
  std::shared_ptr<Exchange> Handle(const Question& question,
                                   const std::shared_ptr<AnswerSink>& sink) const;

 private:
  struct Bytes {
    std::string body;
    std::string etag;
  };
  struct File {
    std::string type;
    Bytes plain;
    Bytes packed;  // by gzip; empty where the viewer's build made none
  };

  Pages(grpc::GenericStub& stub, CallCount& count) : stub_(stub), count_(count) {}
  std::shared_ptr<Exchange> HandleTile(const Question& question,
                                       const TilePath& tile,
                                       const std::shared_ptr<AnswerSink>& sink) const;
  std::shared_ptr<Exchange> HandleHealth(const Question& question,
                                         const std::shared_ptr<AnswerSink>& sink) const;
  std::shared_ptr<Exchange> Begin(const CallHead& head,
                                  const std::string& request,
                                  std::function<Answer(const std::string& bytes)> answer,
                                  std::function<Answer(const grpc::Status& status)> error,
                                  const std::shared_ptr<AnswerSink>& sink) const;

  grpc::GenericStub& stub_;
  CallCount& count_;
  std::map<std::string, File, std::less<>> files_;
  std::string openapi_;
};

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_PAGES_H_
