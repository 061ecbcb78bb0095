// The store that the contract suite is run against. Each program that links the suite defines
// MakeTestStore() for one implementation.
#ifndef STRATA_TESTS_CORE_STORAGE_CONTRACT_TEST_STORE_H_
#define STRATA_TESTS_CORE_STORAGE_CONTRACT_TEST_STORE_H_

#include <cstdint>
#include <filesystem>
#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata::testing {

// One map that a test works on.
class TestStore {
 public:
  virtual ~TestStore() = default;
  virtual absl::Status Create(const MapParameters& parameters,
                              absl::Time created,
                              std::uint64_t clock) = 0;
  virtual absl::StatusOr<std::unique_ptr<MapStorage>> Open() = 0;
  // Another map beside it, made of a map file and opened.
  virtual absl::StatusOr<std::unique_ptr<MapStorage>> Import(const std::filesystem::path& file) = 0;
  // Takes the map away, or puts another in its place, whether it is open or not.
  virtual absl::Status TakeAway() = 0;
  // Sets the pose or the header of all scans to `bytes`, past the interface.
  virtual absl::Status DamagePoses(absl::string_view bytes) = 0;
  virtual absl::Status DamageHeaders(absl::string_view bytes) = 0;
};

// Files, if any, in `directory`. FAILED_PRECONDITION saying why the machine cannot run it.
absl::StatusOr<std::unique_ptr<TestStore>> MakeTestStore(const std::filesystem::path& directory);

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_STORAGE_CONTRACT_TEST_STORE_H_
