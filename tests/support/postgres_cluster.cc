#include "tests/support/postgres_cluster.h"

#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <fcntl.h>
#include <pwd.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/common/status.h"
#include "core/storage/postgresql/connection.h"
#include "tests/support/patience.h"

namespace strata::testing {
namespace {

constexpr char kPrograms[] = "/usr/lib/postgresql/15/bin/";
constexpr char kMemory[] = "/dev/shm";
constexpr std::uintmax_t kRoomBytes = std::uintmax_t{1} << 30;  // some four times what one takes

// PostgreSQL refuses to run as root.
const passwd* UserWithoutRights() {
  const passwd* user = getpwnam("postgres");
  return user != nullptr ? user : getpwnam("nobody");
}

absl::Status WaitFor(pid_t child, absl::string_view what) {
  int status = 0;
  if (child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
      WEXITSTATUS(status) == 0) {
    return absl::OkStatus();
  }
  return absl::InternalError(absl::StrCat(what, " failed"));
}

}  // namespace

absl::StatusOr<std::unique_ptr<PostgresCluster>> PostgresCluster::Start(Disk disk) {
  if (!std::filesystem::exists(absl::StrCat(kPrograms, "initdb"))) {
    return absl::FailedPreconditionError(
        "PostgreSQL 15 is absent: deploy/install-packages.sh --dev installs it");
  }
  std::unique_ptr<PostgresCluster> cluster(new PostgresCluster(disk));
  STRATA_RETURN_IF_ERROR(cluster->MakeFiles());
  STRATA_RETURN_IF_ERROR(cluster->Restart());
  return cluster;
}

PostgresCluster::~PostgresCluster() {
  Crash();
  std::error_code ignored;
  std::filesystem::remove_all(data_, ignored);
}

std::string PostgresCluster::AddressOf(absl::string_view database) const {
  return absl::StrCat("host=", directory_.path().string(), " user=strata dbname=", database);
}

std::string PostgresCluster::AddressOfOwn(absl::string_view owner) {
  if (const auto it = databases_.find(std::string(owner)); it != databases_.end()) {
    return AddressOf(it->second);
  }
  const auto connection = Connection::Open(Address());
  if (!connection.ok()) return "";
  DropOfGoneOwners(**connection);
  const std::string name = absl::StrCat("own", ++databases_made_);
  const std::string sql = absl::StrCat("CREATE DATABASE ", name);
  if (!(*connection)->Execute(sql.c_str()).ok()) return "";
  databases_.emplace(owner, name);
  return AddressOf(name);
}

void PostgresCluster::DropOfGoneOwners(Connection& connection) {
  std::erase_if(databases_, [&](const auto& database) {
    const auto& [owner, name] = database;
    if (!std::filesystem::path(owner).is_absolute() || std::filesystem::exists(owner)) return false;
    const std::string sql = absl::StrCat("DROP DATABASE ", name, " WITH (FORCE)");
    return connection.Execute(sql.c_str()).ok();
  });
}

pid_t PostgresCluster::Spawn(const std::vector<std::string>& command) const {
  const passwd* user = geteuid() == 0 ? UserWithoutRights() : nullptr;
  const std::string log = directory_.path() / "log";
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child != 0) return child;
  // Only async-signal-safe calls until exec.
  const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0666);
  dup2(out, STDOUT_FILENO);
  dup2(out, STDERR_FILENO);
  if (user != nullptr && (setgid(user->pw_gid) != 0 || setuid(user->pw_uid) != 0)) _exit(126);
  prctl(PR_SET_PDEATHSIG, SIGQUIT);  // after the change of user, which clears it
  if (chdir("/tmp") != 0) _exit(126);
  execv(argv[0], argv.data());
  _exit(127);
}

absl::Status PostgresCluster::MakeFolder() {
  std::error_code error;
  const std::uintmax_t room = std::filesystem::space(kMemory, error).available;
  std::string pattern = absl::StrCat(kMemory, "/strata-XXXXXX");
  const bool in_memory = disk_ == Disk::kUnsynced && !error && room >= kRoomBytes &&
                         mkdtemp(pattern.data()) != nullptr;
  data_ = in_memory ? std::filesystem::path(pattern) : directory_.path() / "data";
  std::filesystem::create_directory(data_, error);
  if (geteuid() != 0) return absl::OkStatus();
  const passwd* user = UserWithoutRights();
  for (const std::filesystem::path& folder : {directory_.path(), data_}) {
    if (user == nullptr || chown(folder.c_str(), user->pw_uid, user->pw_gid) != 0) {
      return absl::FailedPreconditionError("no user without rights to run PostgreSQL as");
    }
  }
  return absl::OkStatus();
}

absl::Status PostgresCluster::MakeFiles() {
  STRATA_RETURN_IF_ERROR(MakeFolder());
  return WaitFor(Spawn({absl::StrCat(kPrograms, "initdb"),
                        "--pgdata",
                        data_,
                        "--auth=trust",
                        "--username=strata",
                        "--encoding=UTF8",
                        "--locale=C",
                        "--no-sync"}),
                 "initdb");
}

absl::Status PostgresCluster::Restart() {
  std::vector<std::string> command = {absl::StrCat(kPrograms, "postgres"), "-D", data_};
  const auto set = [&](absl::string_view setting) {
    command.insert(command.end(), {"-c", std::string(setting)});
  };
  set("listen_addresses=");
  set(absl::StrCat("unix_socket_directories=", directory_.path().string()));
  set("shared_buffers=64MB");
  set("max_connections=200");
  if (disk_ == Disk::kUnsynced) {
    set("fsync=off");
    set("max_wal_size=128MB");  // of memory
  }
  server_ = Spawn(command);
  absl::Status answer;
  for (const absl::Time end = absl::Now() + kPatience; absl::Now() < end;) {
    answer = Connection::Open(Address()).status();
    if (answer.ok()) return answer;
    absl::SleepFor(absl::Milliseconds(20));
  }
  return answer;
}

void PostgresCluster::Crash() {
  if (server_ <= 0) return;
  kill(server_, SIGQUIT);
  waitpid(server_, nullptr, 0);
  server_ = -1;
}

absl::StatusOr<PostgresCluster*> SharedPostgresCluster() {
  static const absl::StatusOr<std::unique_ptr<PostgresCluster>> cluster =
      PostgresCluster::Start(PostgresCluster::Disk::kUnsynced);
  if (!cluster.ok()) return cluster.status();
  return cluster->get();
}

}  // namespace strata::testing
