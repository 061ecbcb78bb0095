#include "server/access/token_file.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/common/status.h"
#include "core/world/names.h"
#include "server/access/utc_text.h"

namespace strata::server {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kVersion = 1;
constexpr std::size_t kIdLength = 12;
constexpr std::size_t kHashLength = 64;

absl::Status Errno(absl::string_view what, const fs::path& path) {
  return absl::ErrnoToStatus(errno, absl::StrCat("cannot ", what, " ", path.string()));
}

absl::Status Wrong(absl::string_view what) { return absl::InvalidArgumentError(what); }

absl::StatusOr<std::string> StringOf(const json& object, const char* field) {
  const auto found = object.find(field);
  if (found == object.end() || !found->is_string()) {
    return Wrong(absl::StrCat("\"", field, "\" is missing or no string"));
  }
  return found->get<std::string>();
}

absl::StatusOr<absl::Time> TimeOf(const json& object, const char* field) {
  STRATA_ASSIGN_OR_RETURN(const std::string text, StringOf(object, field));
  absl::Time time;
  std::string error;
  if (absl::ParseTime(absl::RFC3339_full, text, &time, &error)) return time;
  return Wrong(absl::StrCat("\"", field, "\": '", text, "' is no RFC 3339 time"));
}

bool IsHex(absl::string_view text, std::size_t length) {
  return text.size() == length && std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return absl::ascii_isdigit(c) || (c >= 'a' && c <= 'f');
         });
}

absl::Status CheckFields(const json& object, const std::set<std::string>& known) {
  if (!object.is_object()) return Wrong("no object");
  for (const auto& [field, value] : object.items()) {
    if (!known.contains(field)) return Wrong(absl::StrCat("unknown field \"", field, "\""));
  }
  return absl::OkStatus();
}

absl::Status DecodeMaps(const json& object, Grant& grant) {
  const auto maps = object.find("maps");
  if (maps == object.end() || !maps->is_object() || maps->empty()) {
    return Wrong("\"maps\" is missing, empty or no object");
  }
  for (const auto& [map, value] : maps->items()) {
    if (map != kAllMaps) STRATA_RETURN_IF_ERROR(ValidateName("map name", map));
    const std::optional<Right> right =
        value.is_string() ? ParseRight(value.get<std::string>()) : std::nullopt;
    if (!right.has_value()) {
      return Wrong(absl::StrCat("\"maps\": ", map, ": write \"read\", \"write\" or \"admin\""));
    }
    grant.maps[map] = *right;
  }
  return absl::OkStatus();
}

absl::StatusOr<Grant> DecodeGrant(const json& object) {
  STRATA_RETURN_IF_ERROR(
      CheckFields(object, {"id", "name", "secret_sha256", "maps", "created", "expires"}));
  Grant grant;
  STRATA_ASSIGN_OR_RETURN(grant.name, StringOf(object, "name"));
  STRATA_RETURN_IF_ERROR(ValidateName("name", grant.name));
  STRATA_ASSIGN_OR_RETURN(grant.id, StringOf(object, "id"));
  if (!IsHex(grant.id, kIdLength)) return Wrong("\"id\" is not 12 hexadecimal digits");
  if (object.contains("secret_sha256")) {
    STRATA_ASSIGN_OR_RETURN(grant.secret_sha256, StringOf(object, "secret_sha256"));
    if (!IsHex(grant.secret_sha256, kHashLength)) {
      return Wrong("\"secret_sha256\" is not 64 hexadecimal digits");
    }
  }
  STRATA_RETURN_IF_ERROR(DecodeMaps(object, grant));
  STRATA_ASSIGN_OR_RETURN(grant.created, TimeOf(object, "created"));
  if (object.contains("expires")) {
    STRATA_ASSIGN_OR_RETURN(grant.expires, TimeOf(object, "expires"));
  }
  return grant;
}

json ToJson(const Grant& grant) {
  json object = {{"id", grant.id}, {"name", grant.name}, {"created", UtcText(grant.created)}};
  if (!grant.by_certificate()) object["secret_sha256"] = grant.secret_sha256;
  for (const auto& [map, right] : grant.maps) object["maps"][map] = std::string(RightName(right));
  if (grant.expires != absl::InfiniteFuture()) object["expires"] = UtcText(grant.expires);
  return object;
}

absl::Status WriteAll(int fd, absl::string_view bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return Errno("write", path);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return ::fsync(fd) == 0 ? absl::OkStatus() : Errno("sync", path);
}

// A server that runs as another user than the one who adds a token must still read the file.
absl::Status TakeOwnerAndMode(int fd, const fs::path& path) {
  struct stat old {};
  if (::stat(path.c_str(), &old) != 0) return absl::OkStatus();  // a new file
  struct stat made {};
  if (::fstat(fd, &made) != 0) return Errno("stat", path);
  const bool same = made.st_uid == old.st_uid && made.st_gid == old.st_gid;
  if (!same && ::fchown(fd, old.st_uid, old.st_gid) != 0) return Errno("keep the owner of", path);
  return ::fchmod(fd, old.st_mode & 0777U) == 0 ? absl::OkStatus()
                                                : Errno("keep the mode of", path);
}

absl::Status SyncDirectoryOf(const fs::path& path) {
  const fs::path directory = fs::absolute(path).parent_path();
  const int fd = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return Errno("open", directory);
  const absl::Cleanup close = [fd] { ::close(fd); };
  return ::fsync(fd) == 0 ? absl::OkStatus() : Errno("sync", directory);
}

}  // namespace

std::string EncodeGrants(const std::vector<Grant>& grants) {
  json file = {{"version", kVersion}, {"grants", json::array()}};
  for (const Grant& grant : grants) file["grants"].push_back(ToJson(grant));
  return file.dump(2) + "\n";
}

absl::StatusOr<std::vector<Grant>> DecodeGrants(absl::string_view text) {
  const json file = json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/false);
  if (file.is_discarded()) return Wrong("token file: no JSON");
  STRATA_RETURN_IF_ERROR(Annotate(CheckFields(file, {"version", "grants"}), "token file"));
  if (file.value("version", json()) != kVersion) {
    return Wrong(absl::StrCat("token file: \"version\" is not ", kVersion));
  }
  const json list = file.value("grants", json());
  if (!list.is_array()) return Wrong("token file: \"grants\" is missing or no array");
  std::vector<Grant> grants;
  std::set<std::string> names;
  std::set<std::string> ids;
  for (const json& object : list) {
    absl::StatusOr<Grant> grant = DecodeGrant(object);
    if (!grant.ok()) {
      return Annotate(grant.status(), absl::StrCat("token file: grant ", grants.size() + 1));
    }
    if (!names.insert(grant->name).second || !ids.insert(grant->id).second) {
      return Wrong(absl::StrCat("token file: name or id of ", grant->name, " occurs twice"));
    }
    grants.push_back(*std::move(grant));
  }
  return grants;
}

absl::StatusOr<std::vector<Grant>> ReadTokenFile(const fs::path& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) return Errno("open token file", path);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (file.bad()) return Errno("read token file", path);
  absl::StatusOr<std::vector<Grant>> grants = DecodeGrants(text);
  if (!grants.ok()) return Annotate(grants.status(), path.string());
  return grants;
}

absl::Status WriteTokenFile(const fs::path& path, const std::vector<Grant>& grants) {
  std::string making = path.string() + ".XXXXXX";
  const int fd = ::mkostemp(making.data(), O_CLOEXEC);  // mode 0600
  if (fd < 0) return Errno("make a file beside", path);
  absl::Cleanup remove = [&making] { ::unlink(making.c_str()); };
  {
    const absl::Cleanup close = [fd] { ::close(fd); };
    STRATA_RETURN_IF_ERROR(TakeOwnerAndMode(fd, path));
    STRATA_RETURN_IF_ERROR(WriteAll(fd, EncodeGrants(grants), path));
  }
  if (::rename(making.c_str(), path.c_str()) != 0) return Errno("replace", path);
  std::move(remove).Cancel();
  return SyncDirectoryOf(path);
}

absl::Status ChangeTokenFile(const fs::path& path,
                             absl::FunctionRef<absl::Status(std::vector<Grant>&)> change) {
  const fs::path lock_file = path.string() + ".lock";
  const int lock = ::open(lock_file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock < 0) return Errno("open", lock_file);
  const absl::Cleanup close = [lock] { ::close(lock); };
  if (::flock(lock, LOCK_EX) != 0) return Errno("lock", lock_file);
  absl::StatusOr<std::vector<Grant>> grants = ReadTokenFile(path);
  if (absl::IsNotFound(grants.status())) grants = std::vector<Grant>();
  STRATA_RETURN_IF_ERROR(grants.status());
  STRATA_RETURN_IF_ERROR(change(*grants));
  return WriteTokenFile(path, *grants);
}

}  // namespace strata::server
