#include "client/cli/terminal/contexts.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "client/cli/terminal/usage.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uintmax_t kMostBytes = 1 << 20;  // of the file
constexpr std::size_t kMostLetters = 64;        // of a name

// The texts of a context and their keys in the file.
std::vector<std::pair<const char*, std::string*>> TextsOf(SavedContext& context) {
  ServerOptions& server = context.server;
  return {{"server", &server.server},
          {"embedded", &context.embedded},
          {"tls_ca", &server.tls_ca},
          {"tls_cert", &server.tls_certificate},
          {"tls_key", &server.tls_key},
          {"tls_name", &server.tls_name},
          {"token_file", &server.token_file},
          {"token", &server.token}};
}

absl::StatusOr<SavedContext> ContextOf(const std::string& name, const Json& json) {
  SavedContext context;
  context.server.server.clear();
  for (const auto& [key, text] : TextsOf(context)) {
    const Json value = json.value(key, Json(""));
    if (!value.is_string()) {
      return absl::InvalidArgumentError(absl::StrCat("context ", name, ": ", key, " is no text"));
    }
    *text = value.get<std::string>();
  }
  const Json insecure = json.value("insecure", Json(false));
  context.server.insecure = insecure.is_boolean() && insecure.get<bool>();
  context.server.context = name;
  if (context.server.server.empty() == context.embedded.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("context ", name, " must have either a server or a directory (embedded)"));
  }
  return context;
}

absl::StatusOr<Contexts> ContextsOf(const Json& json) {
  Contexts contexts;
  const Json named = json.is_object() ? json.value("contexts", Json::object()) : Json();
  const Json current = json.is_object() ? json.value("current", Json("")) : Json();
  if (!named.is_object() || !current.is_string()) {
    return absl::InvalidArgumentError("expected an object of JSON with current and contexts");
  }
  contexts.current = current.get<std::string>();
  for (const auto& [name, value] : named.items()) {
    STRATA_RETURN_IF_ERROR(ValidateContextName(name));
    if (!value.is_object()) return absl::InvalidArgumentError(absl::StrCat(name, " is no object"));
    STRATA_ASSIGN_OR_RETURN(contexts.named[name], ContextOf(name, value));
  }
  return contexts;
}

std::string TextOfContexts(Contexts contexts) {
  Json named = Json::object();
  for (auto& [name, context] : contexts.named) {
    Json json = Json::object();
    for (const auto& [key, text] : TextsOf(context)) {
      if (!text->empty()) json[key] = *text;
    }
    if (context.server.insecure) json["insecure"] = true;
    named[name] = std::move(json);
  }
  return Json{{"current", contexts.current}, {"contexts", std::move(named)}}.dump(2) + "\n";
}

absl::Status CannotWrite(const std::filesystem::path& path) {
  return absl::ErrnoToStatus(errno, absl::StrCat("cannot write ", path.string()));
}

}  // namespace

absl::StatusOr<std::filesystem::path> ContextsPath() {
  const auto folder = [](const char* variable) {
    const char* value = std::getenv(variable);
    return std::filesystem::path(value == nullptr ? "" : value);
  };
  // A path of XDG that is not absolute is none.
  if (const auto config = folder("XDG_CONFIG_HOME"); config.is_absolute()) {
    return config / "strata" / "contexts.json";
  }
  if (const auto home = folder("HOME"); home.is_absolute()) {
    return home / ".config" / "strata" / "contexts.json";
  }
  return absl::NotFoundError("contexts have no place: neither XDG_CONFIG_HOME nor HOME is set");
}

absl::StatusOr<Contexts> ReadContexts(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error == std::errc::no_such_file_or_directory) return Contexts();
  if (!error && size > kMostBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat(path.string(), ": ", size, " bytes, at most ", kMostBytes, " are read"));
  }
  std::ifstream file(path);
  std::ostringstream bytes;
  if (error || !(bytes << file.rdbuf())) {
    return absl::InvalidArgumentError(absl::StrCat("cannot read ", path.string()));
  }
  absl::StatusOr<Contexts> contexts = ContextsOf(Json::parse(bytes.str(), nullptr, false));
  return contexts.ok() ? std::move(contexts) : Annotate(contexts.status(), path.string());
}

absl::Status WriteContexts(const std::filesystem::path& path, const Contexts& contexts) {
  std::error_code error;
  const std::filesystem::path folder = path.parent_path();
  if (std::filesystem::create_directories(folder, error)) {
    std::filesystem::permissions(folder, std::filesystem::perms::owner_all, error);
  }
  std::string next = absl::StrCat(path.string(), ".XXXXXX");
  const int file = mkstemp(next.data());  // of mode 0600
  if (file < 0) return CannotWrite(path);
  const std::string text = TextOfContexts(contexts);
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                       fsync(file) == 0;
  const bool closed = close(file) == 0;
  if (written && closed && std::rename(next.c_str(), path.c_str()) == 0) return absl::OkStatus();
  const absl::Status failed = CannotWrite(path);
  std::filesystem::remove(next, error);
  return failed;
}

absl::Status ValidateContextName(const std::string& name) {
  const bool good = !name.empty() && name.size() <= kMostLetters && name.front() != '-' &&
                    std::all_of(name.begin(), name.end(), [](char letter) {
                      return absl::ascii_isalnum(static_cast<unsigned char>(letter)) ||
                             std::strchr("._-", letter) != nullptr;
                    });
  if (good) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("a context's name has letters, digits, dots, dashes and underscores, at most ",
                   kMostLetters,
                   " of them; got '",
                   name.substr(0, 2 * kMostLetters),
                   "'"));
}

absl::StatusOr<SavedContext> FindContext(const Contexts& contexts, const std::string& name) {
  const auto found = contexts.named.find(name);
  if (found != contexts.named.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [each, context] : contexts.named) names.push_back(each);
  const std::string nearest = Nearest(name, names);
  return absl::NotFoundError(absl::StrCat(
      "context ",
      name,
      " does not exist; ",
      nearest.empty() ? "see strata context list" : absl::StrCat("did you mean ", nearest, "?")));
}

absl::StatusOr<SavedContext> ResolveContext(const Said& said, const std::filesystem::path& path) {
  SavedContext target{.server = said.flags, .embedded = said.embedded};
  const bool named = !said.context.empty();
  if (!named &&
      (said.server || !said.embedded.empty() || std::getenv(kServerVariable) != nullptr)) {
    return target;
  }
  STRATA_ASSIGN_OR_RETURN(const Contexts contexts, ReadContexts(path));
  const std::string name = named ? said.context : contexts.current;
  if (name.empty()) return target;
  STRATA_ASSIGN_OR_RETURN(SavedContext context, FindContext(contexts, name));
  const char* token = std::getenv(kTokenVariable);
  const bool has_token =
      !said.flags.token_file.empty() || (!named && token != nullptr && *token != '\0');
  if (has_token) context.server.token_file = context.server.token = "";
  SavedContext flags = target;
  flags.server.server = said.server ? flags.server.server : "";
  const auto from = TextsOf(flags);
  const auto to = TextsOf(context);
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (!from[i].second->empty()) *to[i].second = *from[i].second;
  }
  if (said.server) context.embedded.clear();
  context.server.insecure |= said.flags.insecure;
  return context;
}

}  // namespace strata::cli
