#include "server/token_commands.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"

#include "core/common/status.h"
#include "core/world/names.h"
#include "server/access/right.h"
#include "server/access/token.h"
#include "server/access/token_file.h"
#include "server/access/utc_text.h"

namespace strata::server {
namespace {

struct Written {
  std::string file;
  std::string name;
  std::string right;
  std::vector<std::string> maps;
  bool all_maps = false;
  bool certificate = false;
  std::string expires = "365d";
};

std::string TimeText(absl::Time time) {
  return time == absl::InfiniteFuture() ? "never" : UtcText(time);
}

absl::StatusOr<Grant> GrantOf(const Written& written, const Token& token) {
  Grant grant;
  grant.id = token.id;
  grant.name = written.name;
  STRATA_RETURN_IF_ERROR(ValidateName("name", grant.name));
  if (!written.certificate) grant.secret_sha256 = SecretHash(token.secret);
  const Right right = ParseRight(written.right).value_or(Right::kRead);  // CLI11 checked it
  if (written.all_maps) grant.maps[kAllMaps] = right;
  for (const std::string& map : written.maps) {
    STRATA_RETURN_IF_ERROR(ValidateName("map name", map));
    grant.maps[map] = right;
  }
  if (grant.maps.empty()) {
    return absl::InvalidArgumentError("name the maps (--map NAME …) or write --all-maps");
  }
  STRATA_ASSIGN_OR_RETURN(const absl::Duration lifetime, ParseLifetime(written.expires));
  grant.created = absl::Now();
  grant.expires = grant.created + lifetime;
  return grant;
}

absl::Status AddGrant(const Written& written, std::ostream& out) {
  STRATA_ASSIGN_OR_RETURN(const Token token, NewToken());
  STRATA_ASSIGN_OR_RETURN(const Grant grant, GrantOf(written, token));
  STRATA_RETURN_IF_ERROR(
      ChangeTokenFile(written.file, [&grant](std::vector<Grant>& grants) -> absl::Status {
        for (const Grant& other : grants) {
          if (other.name != grant.name) continue;
          return absl::AlreadyExistsError(
              absl::StrCat(grant.name, " has access; revoke that first, or choose another name"));
        }
        grants.push_back(grant);
        return absl::OkStatus();
      }));
  // Nothing else on stdout: it is what a script keeps.
  if (!grant.by_certificate()) out << token.ToString() << std::endl;
  return absl::OkStatus();
}

absl::Status List(const Written& written, std::ostream& out) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<Grant> grants, ReadTokenFile(written.file));
  constexpr char kRow[] = "%-24s %-12s %-11s %-20s %-20s %s\n";
  out << absl::StreamFormat(kRow, "name", "id", "by", "created", "expires", "maps");
  for (const Grant& grant : grants) {
    const bool expired = absl::Now() >= grant.expires;
    out << absl::StreamFormat(kRow,
                              grant.name,
                              grant.id,
                              grant.by_certificate() ? "certificate" : "token",
                              TimeText(grant.created),
                              expired ? "expired" : TimeText(grant.expires),
                              grant.RightsText());
  }
  return absl::OkStatus();
}

absl::Status Revoke(const Written& written) {
  return ChangeTokenFile(written.file, [&](std::vector<Grant>& grants) -> absl::Status {
    if (std::erase_if(grants, [&](const Grant& g) { return g.name == written.name; }) > 0) {
      return absl::OkStatus();
    }
    return absl::NotFoundError(absl::StrCat("nobody is called ", written.name));
  });
}

void AddFileOption(CLI::App& verb, Written& written) {
  verb.add_option("--tokens", written.file, "The file that stratad --tokens names")
      ->type_name("FILE")
      ->required();
}

void AddNameOption(CLI::App& verb, Written& written) {
  verb.add_option("NAME", written.name, "Of the client, as logs say it")->required();
}

void AddAdd(CLI::App& token, const std::shared_ptr<Written>& written, CommandAction& selected) {
  CLI::App* add = token.add_subcommand(
      "add", "Give a client access; prints its token, once: the file keeps only a hash");
  AddNameOption(*add, *written);
  AddFileOption(*add, *written);
  add->add_option("--right", written->right, "Each includes those before it")
      ->check(CLI::IsMember({"read", "write", "admin"}))
      ->required();
  CLI::Option* map =
      add->add_option("--map", written->maps, "Maps it holds for")->type_name("NAME");
  add->add_flag("--all-maps", written->all_maps, "All maps, those to come included")->excludes(map);
  add->add_flag("--certificate",
                written->certificate,
                "No token: the client shows a certificate with the common name NAME "
                "(--tls-client-ca)");
  add->add_option("--expires", written->expires, "From now on, as 30d, 12h, 90m, or never")
      ->capture_default_str();
  add->footer(
      "Example:\n  stratad token add robot7 --right write --map campus --tokens tokens.json > "
      "robot7.token");
  add->callback([written, &selected] {
    selected = [written](std::ostream& out) { return AddGrant(*written, out); };
  });
}

}  // namespace

absl::StatusOr<absl::Duration> ParseLifetime(absl::string_view text) {
  if (text == "never") return absl::InfiniteDuration();
  const absl::Duration units[] = {absl::Hours(24), absl::Hours(1), absl::Minutes(1)};
  const std::size_t unit =
      text.empty() ? absl::string_view::npos : absl::string_view("dhm").find(text.back());
  int count = 0;
  if (unit != absl::string_view::npos &&
      absl::SimpleAtoi(text.substr(0, text.size() - 1), &count) && count > 0) {
    const absl::Duration lifetime = count * units[unit];
    if (lifetime <= absl::Hours(24) * 36525) return lifetime;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("'", text, "': write 30d, 12h, 90m (at most 100 years) or never"));
}

void AddTokenCommands(CLI::App& app, CommandAction& selected) {
  const auto written = std::make_shared<Written>();
  CLI::App* token = app.add_subcommand("token", "Who may do what (the file of --tokens)");
  token->require_subcommand(1);
  AddAdd(*token, written, selected);
  CLI::App* list = token->add_subcommand("list", "Everybody who has access");
  AddFileOption(*list, *written);
  list->footer("Example:\n  stratad token list --tokens tokens.json");
  list->callback([written, &selected] {
    selected = [written](std::ostream& out) { return List(*written, out); };
  });
  CLI::App* revoke = token->add_subcommand("revoke", "Take a client's access away, at once");
  AddNameOption(*revoke, *written);
  AddFileOption(*revoke, *written);
  revoke->footer("Example:\n  stratad token revoke robot7 --tokens tokens.json");
  revoke->callback(
      [written, &selected] { selected = [written](std::ostream&) { return Revoke(*written); }; });
}

}  // namespace strata::server
