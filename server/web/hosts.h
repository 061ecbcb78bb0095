// Which names of the server browsers may use, and whose pages may call it.
#ifndef STRATA_SERVER_WEB_HOSTS_H_
#define STRATA_SERVER_WEB_HOSTS_H_

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace strata::server::web {

// A page of anybody's may make a name of its own point to this machine (DNS rebinding), and the
// browser then takes our answers for that page's. So only names are taken that nobody else decides
// on: "localhost", addresses, and those that whoever runs the server has given it. Thread-safe.
class Hosts {
 public:
  // `names` without ports, in any case.
  explicit Hosts(const std::vector<std::string>& names);

  // `host`: a Host header, NAME[:PORT].
  bool Take(absl::string_view host) const;

 private:
  std::set<std::string, std::less<>> names_;
};

// Whether `origin`, an Origin header, is of a page that came from `host`, the request's Host
// header. The scheme is not compared: TLS may end before this server.
bool IsSameOrigin(absl::string_view origin, absl::string_view host);

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_HOSTS_H_
