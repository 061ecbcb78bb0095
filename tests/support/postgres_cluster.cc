#include "tests/support/postgres_cluster.h"

#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
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

namespace strata::testing {
namespace {

constexpr char kPrograms[] = "/usr/lib/postgresql/15/bin/";

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

PostgresCluster::~PostgresCluster() { Crash(); }

std::string PostgresCluster::AddressOf(absl::string_view database) const {
  return absl::StrCat("host=", directory_.path().string(), " user=strata dbname=", database);
}

std::string PostgresCluster::AddressOfOwn(absl::string_view owner) {
  const auto [it, inserted] = databases_.try_emplace(std::string(owner));
  if (!inserted) return it->second;
  const auto connection = Connection::Open(Address());
  const std::string name = absl::StrCat("own", databases_.size());
  const std::string sql = absl::StrCat("CREATE DATABASE ", name);
  if (connection.ok() && (*connection)->Execute(sql.c_str()).ok()) it->second = AddressOf(name);
  return it->second;
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

absl::Status PostgresCluster::MakeFiles() {
  if (geteuid() == 0) {
    const passwd* user = UserWithoutRights();
    if (user == nullptr || chown(directory_.path().c_str(), user->pw_uid, user->pw_gid) != 0) {
      return absl::FailedPreconditionError("no user without rights to run PostgreSQL as");
    }
  }
  return WaitFor(Spawn({absl::StrCat(kPrograms, "initdb"),
                        "--pgdata",
                        directory_.path() / "data",
                        "--auth=trust",
                        "--username=strata",
                        "--encoding=UTF8",
                        "--locale=C",
                        "--no-sync"}),
                 "initdb");
}

absl::Status PostgresCluster::Restart() {
  const std::string fsync = disk_ == Disk::kSynced ? "fsync=on" : "fsync=off";
  server_ = Spawn({absl::StrCat(kPrograms, "postgres"),
                   "-D",
                   directory_.path() / "data",
                   "-c",
                   "listen_addresses=",
                   "-c",
                   absl::StrCat("unix_socket_directories=", directory_.path().string()),
                   "-c",
                   fsync,
                   "-c",
                   "shared_buffers=64MB",
                   "-c",
                   "max_connections=200"});
  absl::Status answer;
  for (const absl::Time end = absl::Now() + absl::Seconds(60); absl::Now() < end;) {
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
