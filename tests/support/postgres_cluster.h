// A PostgreSQL server of a test's own: in a temporary folder, on a unix socket only, as a user
// without rights, gone with its owner.
#ifndef STRATA_TESTS_SUPPORT_POSTGRES_CLUSTER_H_
#define STRATA_TESTS_SUPPORT_POSTGRES_CLUSTER_H_

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <sys/types.h>

#include "tests/support/temp_dir.h"

namespace strata {
class Connection;
}

namespace strata::testing {

class PostgresCluster {
 public:
  // Unsynced: in memory where the machine has room for that, since making a database makes 300
  // files.
  enum class Disk { kUnsynced, kSynced };

  // FAILED_PRECONDITION saying what to install where PostgreSQL 15 is absent.
  static absl::StatusOr<std::unique_ptr<PostgresCluster>> Start(Disk disk);
  ~PostgresCluster();
  PostgresCluster(const PostgresCluster&) = delete;
  PostgresCluster& operator=(const PostgresCluster&) = delete;

  // Of its first database, for PostgresOptions::where.
  std::string Address() const { return AddressOf("postgres"); }
  std::string AddressOf(absl::string_view database) const;
  // Of a database that belongs to `owner`, a name or path; made when it is first asked for, when
  // those of paths that are no more go. Empty if that fails.
  std::string AddressOfOwn(absl::string_view owner);
  // Ends it as a loss of power would but for what the kernel holds: no process finishes what it
  // does (pg_ctl -m immediate).
  void Crash();
  // After Crash(): comes back by its log. Returns when it answers.
  absl::Status Restart();

 private:
  explicit PostgresCluster(Disk disk) : disk_(disk) {}
  absl::Status MakeFiles();
  absl::Status MakeFolder();
  void DropOfGoneOwners(Connection& connection);
  // Runs as the user without rights; its output goes to a file in the folder.
  pid_t Spawn(const std::vector<std::string>& command) const;

  TempDir directory_;
  std::filesystem::path data_;
  Disk disk_;
  pid_t server_ = -1;
  int databases_made_ = 0;
  std::map<std::string, std::string> databases_;  // names, by their owners
};

// One for the program, unsynced, started when it is first asked for.
absl::StatusOr<PostgresCluster*> SharedPostgresCluster();

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_POSTGRES_CLUSTER_H_
