#include "server/access/access.h"

#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"

#include "core/common/status.h"
#include "proto/translate/status.h"
#include "server/access/token.h"
#include "server/access/utc_text.h"

namespace strata::server {
namespace {

absl::Status Refused(absl::Status status) {
  return translate::WithReason(std::move(status), translate::kAccessReason);
}

// The same for a token that never was and one that was revoked: neither says anything to a guesser.
absl::Status Unknown() {
  return Refused(absl::UnauthenticatedError(
      "the token is unknown or revoked; ask the server's owner for another (stratad token add)"));
}

absl::Status CheckExpiry(const Grant& grant) {
  if (absl::Now() < grant.expires) return absl::OkStatus();
  return Refused(absl::UnauthenticatedError(
      absl::StrCat("the access of ",
                   grant.name,
                   " expired at ",
                   UtcText(grant.expires),
                   "; ask the server's owner for another token (stratad token add)")));
}

absl::StatusOr<Caller> Known(const Grant& grant) {
  STRATA_RETURN_IF_ERROR(CheckExpiry(grant));
  return Caller{grant.id, grant.name};
}

absl::StatusOr<Caller> ByToken(const Grants& grants, absl::string_view authorization) {
  const std::size_t space = authorization.find(' ');
  const bool bearer = absl::EqualsIgnoreCase(authorization.substr(0, space), "bearer");
  const std::optional<Token> token =
      bearer && space != absl::string_view::npos
          ? ParseToken(absl::StripAsciiWhitespace(authorization.substr(space)))
          : std::nullopt;
  if (!token.has_value()) {
    return Refused(absl::UnauthenticatedError(
        "metadata 'authorization' is not 'Bearer ' and a token of this server (strata_…)"));
  }
  const auto found = grants.by_id.find(token->id);
  if (found == grants.by_id.end() || found->second.by_certificate() ||
      !SecretMatches(token->secret, found->second.secret_sha256)) {
    return Unknown();
  }
  return Known(found->second);
}

absl::StatusOr<Caller> ByCertificate(const Grants& grants, absl::string_view name) {
  const auto found = grants.ids_by_certificate.find(std::string(name));
  if (found == grants.ids_by_certificate.end()) {
    return Refused(absl::UnauthenticatedError(absl::StrCat(
        "the certificate's name '", name, "' has no grant (stratad token add --certificate)")));
  }
  return Known(grants.by_id.at(found->second));
}

}  // namespace

absl::StatusOr<Caller> Access::Authenticate(absl::string_view authorization,
                                            absl::string_view certificate_name) {
  if (grants_ == nullptr) return Caller{"", std::string(certificate_name)};
  const std::shared_ptr<const Grants> grants = grants_->Current();
  if (!authorization.empty()) return ByToken(*grants, authorization);
  if (!certificate_name.empty()) return ByCertificate(*grants, certificate_name);
  return Refused(absl::UnauthenticatedError(
      "this server wants a token: metadata 'authorization: Bearer strata_…' (of the command line, "
      "--token-file or STRATA_TOKEN)"));
}

absl::Status Access::StillKnown(const Caller& caller) {
  if (grants_ == nullptr) return absl::OkStatus();
  const std::shared_ptr<const Grants> grants = grants_->Current();
  const auto found = grants->by_id.find(caller.grant_id);
  return found == grants->by_id.end() ? Unknown() : CheckExpiry(found->second);
}

absl::Status Access::Authorize(const Caller& caller, Right right, absl::string_view map) {
  STRATA_RETURN_IF_ERROR(StillKnown(caller));
  if (grants_ == nullptr) return absl::OkStatus();
  const std::shared_ptr<const Grants> grants = grants_->Current();
  const auto found = grants->by_id.find(caller.grant_id);
  if (found != grants->by_id.end() && found->second.Allows(right, map)) return absl::OkStatus();
  constexpr std::size_t kShown = 100;
  return Refused(absl::PermissionDeniedError(absl::StrCat(caller.principal,
                                                          " lacks the right '",
                                                          RightName(right),
                                                          "' on map ",
                                                          map.substr(0, kShown))));
}

bool Access::MayRead(const Caller& caller, absl::string_view map) {
  return Authorize(caller, Right::kRead, map).ok();
}

absl::Duration Access::TokensUnread() {
  return grants_ == nullptr ? absl::ZeroDuration() : grants_->Unread();
}

std::string CertificateNameOf(const grpc::AuthContext& context) {
  if (!context.IsPeerAuthenticated()) return "";
  const std::vector<grpc::string_ref> names = context.FindPropertyValues("x509_common_name");
  return names.empty() ? "" : std::string(names.front().data(), names.front().size());
}

}  // namespace strata::server
