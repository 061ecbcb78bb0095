// Bits of a closed map's file that are not what they were: in every column of every table, and
// anywhere in the file.
#ifndef STRATA_TESTS_CORE_ENGINE_BIT_FLIPS_H_
#define STRATA_TESTS_CORE_ENGINE_BIT_FLIPS_H_

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

#include "tests/core/engine/disk_history.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {

// A column, or those of its rows that `where` tells apart.
struct FlipKind {
  std::string table;
  std::string column;
  std::string where;  // SQL; empty: all rows
  bool blob = false;  // carries a checksum of its own, so that no flip goes unseen

  std::string name() const;
};

struct FlipResult {
  std::int64_t trials = 0;
  std::int64_t refused = 0;  // the map does not open, and says why
  std::int64_t told = 0;     // some answers are errors, verify names something, or both
  std::int64_t same = 0;     // every answer is as before, verify is content
  std::int64_t wrong = 0;    // some answer is another than before, or gone, and not an error
  std::int64_t unnamed = 0;  // of those, and of errors: verify is content
  std::int64_t mended = 0;   // by a rebuild: every answer as before, verify is content
  std::vector<std::string> violations;
  std::vector<std::string> wrong_answers;
};

// A map at the end of its short life (disk_history.h), with an unfinished upload and a proposal
// beside it; or one that keeps no points.
class BitFlips {
 public:
  static absl::StatusOr<BitFlips> Prepare(bool keep_points);

  // Every column that has a row.
  const std::vector<FlipKind>& kinds() const { return kinds_; }
  // A bit of a row of that kind, both chosen by `seed`. A violation: anything but an error value;
  // of a blob, an answer that is wrong and no error, damage that neither verify names nor anybody
  // could tell; of derived data, what a rebuild does not mend.
  void FlipIn(const FlipKind& kind, std::uint64_t seed, FlipResult& result) const;
  // A bit anywhere in the file.
  void FlipAnywhere(std::uint64_t seed, FlipResult& result) const;

 private:
  BitFlips() = default;
  void Judge(const std::string& what,
             const FlipKind* kind,
             const std::filesystem::path& directory,
             FlipResult& result) const;

  std::shared_ptr<TempDir> directory_;  // of the sound map
  WorldState sound_;
  std::vector<FlipKind> kinds_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_ENGINE_BIT_FLIPS_H_
