// What every store of a map must do: the fixture of the suite, whose tests run in every program
// that links strata::storage_contract and says what a store is (test_store.h). check_contract.py
// holds that the suite calls all of core/storage/storage.h.
#ifndef STRATA_TESTS_CORE_STORAGE_CONTRACT_STORAGE_CONTRACT_H_
#define STRATA_TESTS_CORE_STORAGE_CONTRACT_STORAGE_CONTRACT_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include <gtest/gtest.h>

#include "core/storage/storage.h"
#include "tests/core/storage/contract/test_store.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {

class StorageContractTest : public ::testing::Test {
 protected:
  void SetUp() override;
  void Reopen();
  TestStore& store() { return *store_; }
  MapStorage& storage() { return *storage_; }
  StorageWriter& writer() { return storage_->writer(); }
  StorageReader& reader() { return *reader_; }

  absl::Status Commit(absl::FunctionRef<absl::Status()> body) {
    return writer().Commit(Durability::kFull, body);
  }
  static ScanRecord Scan(std::uint64_t sequence);
  // Stores Scan(sequence) with one piece, "bytes"; its upload is `sequence`.
  ScanNumber Put(std::uint64_t sequence);
  // Of the scans that ListScans() finds.
  std::vector<ScanNumber> NumbersOf(const ScanQuery& query);
  absl::Status PutTile(const TileKey& key, std::uint64_t version, bool gone, std::string bytes);

  TempDir directory_;

 private:
  std::unique_ptr<TestStore> store_;
  std::unique_ptr<MapStorage> storage_;
  std::unique_ptr<StorageReader> reader_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_STORAGE_CONTRACT_STORAGE_CONTRACT_H_
