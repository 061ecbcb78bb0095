#include "server/web/router.h"

#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace strata::server::web {
namespace {

constexpr std::size_t kMostQuoted = 100;

std::string Quoted(absl::string_view text) {
  return absl::StrCat("\"", absl::CHexEscape(text.substr(0, kMostQuoted)), "\"");
}

Answer WrongVerb(const Question& question, const char* allowed) {
  Answer answer =
      ErrorAnswer(405,
                  grpc::UNIMPLEMENTED,
                  absl::StrCat(Quoted(question.verb), " is not for this path: ", allowed));
  answer.headers.emplace_back("Allow", allowed);
  return answer;
}

}  // namespace

std::optional<Answer> Router::RefuseSite(const Question& question) const {
  const absl::string_view host = question.Header("host");
  if (!hosts_.Take(host)) {
    return ErrorAnswer(
        403,
        grpc::PERMISSION_DENIED,
        absl::StrCat(
            "host ", Quoted(host), " is no name of this server; if it is, say --web-name"));
  }
  const absl::string_view origin = question.Header("origin");
  if (!origin.empty() && !IsSameOrigin(origin, host)) {
    return ErrorAnswer(403,
                       grpc::PERMISSION_DENIED,
                       absl::StrCat("pages of ", Quoted(origin), " may not call this server"));
  }
  // What modern browsers say of requests without an Origin: images, scripts, links.
  const absl::string_view site = question.Header("sec-fetch-site");
  const bool own = site.empty() || site == "same-origin" || site == "none";
  const bool link =
      pages_.IsViewer(question.path) && question.Header("sec-fetch-mode") == "navigate";
  if (!own && !link) {
    return ErrorAnswer(
        403, grpc::PERMISSION_DENIED, "pages of other sites may not call this server");
  }
  return std::nullopt;
}

std::optional<Answer> Router::Refuse(const Question& question) const {
  if (std::optional<Answer> refused = RefuseSite(question); refused.has_value()) return refused;
  const bool get = question.verb == "GET" || question.verb == "HEAD";
  if (pages_.Has(question.path)) {
    return get ? std::nullopt : std::optional(WrongVerb(question, "GET, HEAD"));
  }
  if (question.verb == "POST") return rpc_.Refuse(question);
  Question post = question;
  post.headers["content-type"] = "application/proto";
  const std::optional<Answer> refused = rpc_.Refuse(post);
  if (refused.has_value() && refused->status == 404) return refused;
  return WrongVerb(question, "POST");
}

std::shared_ptr<Exchange> Router::Handle(const Question& question,
                                         const std::shared_ptr<AnswerSink>& sink) const {
  return pages_.Has(question.path) ? pages_.Handle(question, sink) : rpc_.Handle(question, sink);
}

}  // namespace strata::server::web
