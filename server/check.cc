#include "server/check.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "core/engine/map/map_check.h"
#include "server/access/token_file.h"
#include "server/access/utc_text.h"
#include "server/tls.h"

namespace strata::server {
namespace {

namespace fs = std::filesystem;

constexpr double kMebi = 1 << 20;
constexpr double kFewMebi = 1024.0;
constexpr absl::Duration kSoon = absl::Hours(24 * 14);

Finding Ok(std::string what, std::string message) {
  return {Verdict::kOk, std::move(what), std::move(message)};
}
Finding Warning(std::string what, std::string message) {
  return {Verdict::kWarning, std::move(what), std::move(message)};
}
Finding Error(std::string what, const absl::Status& status) {
  return {Verdict::kError, std::move(what), std::string(status.message())};
}

Finding CheckListen(const ServerOptions& options) {
  const absl::Status exposure = CheckExposure(options);
  if (!exposure.ok()) return Error("listen", exposure);
  if (options.insecure) return Warning("listen", options.listen + ", whatever protects it");
  return Ok("listen", options.listen);
}

Finding CheckCertificate(const TlsFiles& files) {
  const auto certificate = CheckTls(files, absl::Now());
  if (!certificate.ok()) return Error("tls", certificate.status());
  const std::string text =
      absl::StrCat(certificate->subject, ", until ", UtcText(certificate->expires));
  const bool soon = certificate->expires - absl::Now() < kSoon;
  return soon ? Warning("tls", text + ": expires soon") : Ok("tls", text);
}

Finding CheckTokens(const fs::path& file) {
  const auto grants = ReadTokenFile(file);
  if (!grants.ok()) return Error("tokens", grants.status());
  struct stat info {};
  if (::stat(file.c_str(), &info) == 0 && (info.st_mode & 0022U) != 0) {
    return Error("tokens",
                 absl::FailedPreconditionError(absl::StrCat(
                     file.string(), " can be written by others than its owner; chmod 600")));
  }
  const auto expired =
      std::count_if(grants->begin(), grants->end(), [now = absl::Now()](const Grant& grant) {
        return now >= grant.expires;
      });
  const std::string text =
      absl::StrCat(file.string(), ": ", grants->size(), " clients, ", expired, " expired");
  const bool nobody = expired == static_cast<std::ptrdiff_t>(grants->size());
  return nobody ? Warning("tokens", text + ": nobody comes in") : Ok("tokens", text);
}

// RESOURCE_EXHAUSTED for a full disk.
absl::Status CheckWritable(const fs::path& directory) {
  std::string file = (directory / ".check-XXXXXX").string();
  const int fd = ::mkstemp(file.data());
  if (fd < 0)
    return absl::ErrnoToStatus(errno, absl::StrCat("cannot write in ", directory.string()));
  const bool written = ::write(fd, "x", 1) == 1 && ::fsync(fd) == 0;
  const absl::Status status =
      written ? absl::OkStatus()
              : absl::ErrnoToStatus(errno, absl::StrCat("cannot write in ", directory.string()));
  ::close(fd);
  ::unlink(file.c_str());
  return status;
}

Finding CheckDirectory(const fs::path& directory) {
  std::error_code error;
  if (!fs::exists(directory, error)) {
    return Warning("data", absl::StrCat(directory.string(), " is not there; it will be made"));
  }
  if (const absl::Status writable = CheckWritable(directory); !writable.ok()) {
    // What is there can be read from a full disk.
    const bool full = absl::IsResourceExhausted(writable);
    return full ? Warning("data", std::string(writable.message())) : Error("data", writable);
  }
  struct statvfs disk {};
  if (::statvfs(directory.c_str(), &disk) != 0) {
    return Error("data", absl::ErrnoToStatus(errno, directory.string()));
  }
  const double free_mib =
      static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize) / kMebi;
  const std::string text = absl::StrFormat("%s: %.0f MiB free", directory.string(), free_mib);
  struct stat info {};
  if (::stat(directory.c_str(), &info) == 0 && (info.st_mode & 0007U) != 0) {
    return Warning("data", text + ", and everybody on this machine can look into it; chmod 750");
  }
  return free_mib < kFewMebi ? Warning("data", text + ", which is little") : Ok("data", text);
}

// Who has how many of its maps open, too.
Finding CheckDatabase(const std::string& store) {
  const absl::StatusOr<StoreCheck> check = CheckStore(store);
  if (!check.ok()) return Error("store", check.status());
  std::string message = check->format == 0
                            ? std::string("no tables yet; the first start makes them")
                            : absl::StrFormat("tables of format %d, %d map%s",
                                              check->format,
                                              check->maps,
                                              check->maps == 1 ? "" : "s");
  const char* before = "; open: ";
  for (const auto& [server, maps] : check->open) {
    absl::StrAppend(&message, before, server, " ", maps);
    before = ", ";
  }
  before = "; servers: ";
  for (const auto& [server, roles] : check->servers) {
    absl::StrAppend(&message, before, server, " (", roles, ")");
    before = ", ";
  }
  if (check->faults.empty()) return Ok("store", message);
  return Warning("store",
                 absl::StrCat(message,
                              "; ",
                              absl::StrJoin(check->faults, ", "),
                              ": it may lose what was acknowledged"));
}

std::vector<Finding> CheckMapsOf(const std::string& store) {
  const auto maps = CheckDatabaseMaps(store);
  if (!maps.ok()) return {Error("maps", maps.status())};
  std::vector<Finding> findings;
  for (const DatabaseMapCheck& map : *maps) {
    const std::string what = "map " + map.name;
    const double mib = static_cast<double>(map.bytes) / kMebi;
    findings.push_back(map.status.ok() ? Ok(what, absl::StrFormat("read, %.1f MiB", mib))
                                       : Error(what, map.status));
  }
  return findings;
}

const char* NameOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "ok";
    case Verdict::kWarning:
      return "warning";
    case Verdict::kError:
      return "error";
  }
  return "unknown";
}

}  // namespace

std::vector<Finding> CheckInstallation(const ProgramOptions& options) {
  std::vector<Finding> findings = {CheckListen(options.server)};
  if (const absl::Status engine = options.engine.Validate(); !engine.ok()) {
    findings.push_back(Error("options", engine));
  }
  if (options.server.tls.enabled()) findings.push_back(CheckCertificate(options.server.tls));
  if (!options.server.token_file.empty()) {
    findings.push_back(CheckTokens(options.server.token_file));
  }
  findings.push_back(CheckDirectory(options.engine.directory));
  if (!options.engine.store.empty()) findings.push_back(CheckDatabase(options.engine.store));
  return findings;
}

std::vector<Finding> CheckMaps(const EngineOptions& engine) {
  if (!engine.store.empty()) return CheckMapsOf(engine.store);
  const fs::path& directory = engine.directory;
  std::error_code error;
  if (!fs::exists(directory, error)) return {};
  const auto maps = CheckMapFiles(directory);
  if (!maps.ok()) return {Error("maps", maps.status())};
  std::vector<Finding> findings;
  for (const MapFileCheck& map : *maps) {
    const std::string what = "map " + map.name;
    const double mib = static_cast<double>(map.bytes) / kMebi;
    findings.push_back(
        map.status.ok() ? Ok(what, absl::StrFormat("sound, format %d, %.1f MiB", map.format, mib))
                        : Error(what, map.status));
  }
  return findings;
}

std::string ToText(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    absl::StrAppendFormat(
        &text, "%-8s%s: %s\n", NameOf(finding.verdict), finding.what, finding.message);
  }
  return text;
}

std::string ToJson(const std::vector<Finding>& findings) {
  nlohmann::json list = nlohmann::json::array();
  for (const Finding& finding : findings) {
    list.push_back({{"verdict", NameOf(finding.verdict)},
                    {"what", finding.what},
                    {"message", finding.message}});
  }
  const nlohmann::json all = {{"ok", !AnyError(findings)}, {"findings", list}};
  // A file's name may be no UTF-8.
  return all.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

bool AnyError(const std::vector<Finding>& findings) {
  return std::any_of(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.verdict == Verdict::kError;
  });
}

}  // namespace strata::server
