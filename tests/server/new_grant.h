// Access for a test's clients.
#ifndef STRATA_TESTS_SERVER_NEW_GRANT_H_
#define STRATA_TESTS_SERVER_NEW_GRANT_H_

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include <gmock/gmock.h>

#include "server/access/right.h"
#include "server/access/token.h"
#include "server/access/token_file.h"
#include "tests/support/status_matchers.h"

namespace strata::server {

using MapRights = std::map<std::string, Right, std::less<>>;

// A grant and its token as text.
inline std::pair<Grant, std::string> NewGrant(const std::string& name, MapRights maps) {
  const Token token = NewToken().value();
  Grant grant;
  grant.id = token.id;
  grant.name = name;
  grant.secret_sha256 = SecretHash(token.secret);
  grant.maps = std::move(maps);
  grant.created = absl::Now();
  return {grant, token.ToString()};
}

inline void AddToFile(const std::filesystem::path& file, const Grant& grant) {
  EXPECT_THAT(ChangeTokenFile(file,
                              [&grant](std::vector<Grant>& grants) {
                                grants.push_back(grant);
                                return absl::OkStatus();
                              }),
              ::strata::testing::IsOk());
}

}  // namespace strata::server

#endif  // STRATA_TESTS_SERVER_NEW_GRANT_H_
