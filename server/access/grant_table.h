// The grants that hold now.
#ifndef STRATA_SERVER_ACCESS_GRANT_TABLE_H_
#define STRATA_SERVER_ACCESS_GRANT_TABLE_H_

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/log_line.h"
#include "server/access/right.h"

namespace strata::server {

// Grants of one reading of the token file.
struct Grants {
  std::map<std::string, Grant, std::less<>> by_id;
  std::map<std::string, std::string, std::less<>> ids_by_certificate;  // common name → id
};

// What the log says of grants that came, went or are others, a line for each: event=audit, and who
// has which rights now and had before. Nothing of secrets but that one is another.
std::vector<LogLine> ChangesBetween(const Grants& before, const Grants& after);

// Follows a token file: looks at most once in `interval` whether it is another one, so that adding
// and revoking need no restart. While the file cannot be read, what held goes on holding: a slip
// of an editor must not stop every robot. It is tried again at every look and said in the log, at
// once and every minute. What changes is said there, too. Thread-safe.
class GrantTable {
 public:
  // What ReadTokenFile answers.
  static absl::StatusOr<std::unique_ptr<GrantTable>> Open(
      const std::filesystem::path& path, absl::Duration interval = absl::Seconds(1));

  // Never null.
  std::shared_ptr<const Grants> Current();
  // For how long the file cannot be read by now; zero where it can.
  absl::Duration Unread();

 private:
  // What tells one content from another without reading it.
  struct Mark {
    std::uint64_t inode = 0;
    std::int64_t modified_ns = 0;
    std::int64_t size = 0;
    friend bool operator==(const Mark&, const Mark&) = default;
  };

  GrantTable(std::filesystem::path path, absl::Duration interval)
      : path_(std::move(path)), interval_(interval) {}
  static Mark MarkOf(const std::filesystem::path& path);
  absl::Status Load() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Look() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Complain(const absl::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::filesystem::path path_;
  const absl::Duration interval_;
  absl::Mutex mutex_;
  absl::Time looked_ ABSL_GUARDED_BY(mutex_) = absl::InfinitePast();
  Mark mark_ ABSL_GUARDED_BY(mutex_);
  absl::Time unread_since_ ABSL_GUARDED_BY(mutex_) = absl::InfiniteFuture();
  absl::Time complained_ ABSL_GUARDED_BY(mutex_) = absl::InfinitePast();
  std::shared_ptr<const Grants> grants_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_ACCESS_GRANT_TABLE_H_
