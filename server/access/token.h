// A bearer token: what a client shows, and what of it is kept.
#ifndef STRATA_SERVER_ACCESS_TOKEN_H_
#define STRATA_SERVER_ACCESS_TOKEN_H_

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata::server {

// As text: strata_<id>_<secret>.
struct Token {
  std::string id;      // 12 hexadecimal digits; not secret, finds the token's grant
  std::string secret;  // 256 random bits, base64url

  std::string ToString() const;
};

// UNAVAILABLE when the system has no randomness to give.
absl::StatusOr<Token> NewToken();
// nullopt for what cannot be a token.
std::optional<Token> ParseToken(absl::string_view text);

// SHA-256 as 64 hexadecimal digits. One fast hash does: nobody guesses 256 random bits, slow or
// salted hashes are for secrets that people choose.
std::string SecretHash(absl::string_view secret);
// Whether `secret` is the one that was hashed; takes as long wherever they differ.
bool SecretMatches(absl::string_view secret, absl::string_view hash);

}  // namespace strata::server

#endif  // STRATA_SERVER_ACCESS_TOKEN_H_
