// The file of grants: who may do what, with hashes of tokens, never tokens.
#ifndef STRATA_SERVER_ACCESS_TOKEN_FILE_H_
#define STRATA_SERVER_ACCESS_TOKEN_FILE_H_

#include <filesystem>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "server/access/right.h"

namespace strata::server {

// JSON: {"version": 1, "grants": [{"id", "name", "secret_sha256", "maps": {"campus": "write"},
// "created", "expires"}, …]}; times in RFC 3339, no "expires": never.
std::string EncodeGrants(const std::vector<Grant>& grants);
// INVALID_ARGUMENT naming the grant and the field. Unknown fields are refused: a misspelt "expires"
// must not mean never.
absl::StatusOr<std::vector<Grant>> DecodeGrants(absl::string_view text);

// NOT_FOUND, PERMISSION_DENIED or UNAVAILABLE from the file system; INVALID_ARGUMENT as
// DecodeGrants.
absl::StatusOr<std::vector<Grant>> ReadTokenFile(const std::filesystem::path& path);
// The new content as a whole or, also when the power fails, the old one. A new file has mode 0600;
// one that was there keeps its owner and mode.
absl::Status WriteTokenFile(const std::filesystem::path& path, const std::vector<Grant>& grants);
// Reads the file (none: no grants), lets `change` change the grants, and writes them. Of several
// processes that do so at a time each sees what the one before it wrote.
absl::Status ChangeTokenFile(const std::filesystem::path& path,
                             absl::FunctionRef<absl::Status(std::vector<Grant>&)> change);

}  // namespace strata::server

#endif  // STRATA_SERVER_ACCESS_TOKEN_FILE_H_
