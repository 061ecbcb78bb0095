// rosbag2's SQLite files (.db3): tables `topics` and `messages`.
#ifndef STRATA_CLIENT_FORMATS_BAGS_SQLITE_BAG_READER_H_
#define STRATA_CLIENT_FORMATS_BAGS_SQLITE_BAG_READER_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/bag_reader.h"

struct sqlite3;

namespace strata {

inline constexpr absl::string_view kSqliteMagic("SQLite format 3\0", 16);

// Read in the order of their rows, and never written.
class SqliteBagReader final : public BagReader {
 public:
  static absl::StatusOr<std::unique_ptr<BagReader>> Open(const std::filesystem::path& path);

  absl::Status Visit(Visitor visit) override;
  absl::StatusOr<std::string> Read(const MessagePlace& place) override;
  double progress() const override;

 private:
  using Database = std::unique_ptr<sqlite3, int (*)(sqlite3*)>;

  SqliteBagReader(Database database, std::string name)
      : database_(std::move(database)), name_(std::move(name)) {}
  // INVALID_ARGUMENT if the file has not the tables of a bag.
  absl::Status CheckTables();
  absl::Status ReadTopics();
  // Rows behind `after`, up to damage or the end: true at the end.
  absl::StatusOr<bool> VisitAfter(std::int64_t after, Visitor visit);
  std::string Fault() const;  // what SQLite says

  Database database_;
  std::string name_;
  std::map<std::int64_t, std::size_t> numbers_;  // of topics, by their id in the file
  std::int64_t row_ = 0;
  std::int64_t last_row_ = 0;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_SQLITE_BAG_READER_H_
