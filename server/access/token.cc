#include "server/access/token.h"

#include <algorithm>
#include <array>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/rand.h>

#include "core/common/status.h"

namespace strata::server {
namespace {

constexpr char kPrefix[] = "strata_";
constexpr int kIdBytes = 6;
constexpr int kSecretBytes = 32;
constexpr std::size_t kSecretLength = 43;  // of 32 bytes in base64url without padding

absl::StatusOr<std::string> RandomBytes(int count) {
  std::string bytes(static_cast<std::size_t>(count), '\0');
  if (RAND_bytes(reinterpret_cast<unsigned char*>(bytes.data()), count) != 1) {
    return absl::UnavailableError("the system gave no random bytes for a token");
  }
  return bytes;
}

}  // namespace

std::string Token::ToString() const { return absl::StrCat(kPrefix, id, "_", secret); }

absl::StatusOr<Token> NewToken() {
  STRATA_ASSIGN_OR_RETURN(const std::string id, RandomBytes(kIdBytes));
  STRATA_ASSIGN_OR_RETURN(const std::string secret, RandomBytes(kSecretBytes));
  return Token{absl::BytesToHexString(id), absl::WebSafeBase64Escape(secret)};
}

std::optional<Token> ParseToken(absl::string_view text) {
  if (!absl::ConsumePrefix(&text, kPrefix)) return std::nullopt;
  constexpr std::size_t kIdLength = 2 * kIdBytes;
  if (text.size() != kIdLength + 1 + kSecretLength || text[kIdLength] != '_') return std::nullopt;
  Token token{std::string(text.substr(0, kIdLength)), std::string(text.substr(kIdLength + 1))};
  const auto all = [](absl::string_view word, auto good) {
    return std::all_of(word.begin(), word.end(), good);
  };
  const bool good = all(token.id, [](unsigned char c) { return absl::ascii_isxdigit(c); }) &&
                    all(token.secret, [](unsigned char c) {
                      return absl::ascii_isalnum(c) || c == '-' || c == '_';
                    });
  if (!good) return std::nullopt;
  return token;
}

std::string SecretHash(absl::string_view secret) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  EVP_Digest(secret.data(), secret.size(), digest.data(), &size, EVP_sha256(), nullptr);
  return absl::BytesToHexString(
      absl::string_view(reinterpret_cast<const char*>(digest.data()), size));
}

bool SecretMatches(absl::string_view secret, absl::string_view hash) {
  const std::string own = SecretHash(secret);
  return own.size() == hash.size() && CRYPTO_memcmp(own.data(), hash.data(), own.size()) == 0;
}

}  // namespace strata::server
