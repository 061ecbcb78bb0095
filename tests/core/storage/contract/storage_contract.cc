#include "tests/core/storage/contract/storage_contract.h"

#include <utility>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>

#include "core/common/status.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {

void StorageContractTest::SetUp() {
  auto made = MakeTestStore(directory_.path());
  if (absl::IsFailedPrecondition(made.status())) GTEST_SKIP() << made.status().message();
  ASSERT_THAT(made, IsOk());
  store_ = *std::move(made);
  STRATA_ASSERT_OK(store_->Create(MapParameters(), absl::FromUnixSeconds(1000), 0));
  Reopen();
}

void StorageContractTest::Reopen() {
  reader_.reset();
  storage_.reset();
  auto opened = store_->Open();
  ASSERT_THAT(opened, IsOk());
  storage_ = *std::move(opened);
  auto reader = storage_->NewReader();
  ASSERT_THAT(reader, IsOk());
  reader_ = *std::move(reader);
}

ScanRecord StorageContractTest::Scan(std::uint64_t sequence) {
  ScanRecord scan;
  scan.header.id = {"run", sequence};
  scan.header.T_map_scan = MakePose(Eigen::Quaterniond(0.1, 0.2, 0.3, 0.9),
                                    {0.1 + static_cast<double>(sequence), 2.0 / 3.0, -1e7});
  scan.header.point_count = 10 * sequence;
  scan.header.sensor = SensorModel{.sigma_m = 0.0123};
  scan.upload = sequence;
  scan.chunks = 1;
  scan.point_bytes = 5;
  scan.box_scan.extend(Eigen::Vector3f(-1, -2, -3));
  scan.box_scan.extend(Eigen::Vector3f(1, 2, 3));
  scan.content_hash = "hash";
  return scan;
}

ScanNumber StorageContractTest::Put(std::uint64_t sequence) {
  ScanRecord scan = Scan(sequence);
  STRATA_EXPECT_OK(Commit([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(scan.number, writer().NextCommitSequence());
    STRATA_RETURN_IF_ERROR(writer().PutChunk(scan.upload, 0, "bytes"));
    return writer().PutScan(scan);
  }));
  return scan.number;
}

std::vector<ScanNumber> StorageContractTest::NumbersOf(const ScanQuery& query) {
  const absl::StatusOr<std::vector<PosedScan>> scans = reader().ListScans(query, 1);
  STRATA_EXPECT_OK(scans);
  std::vector<ScanNumber> numbers;
  if (!scans.ok()) return numbers;
  for (const PosedScan& scan : *scans) numbers.push_back(scan.scan.number);
  return numbers;
}

absl::Status StorageContractTest::PutTile(const TileKey& key,
                                          std::uint64_t version,
                                          bool gone,
                                          std::string bytes) {
  SurfaceTileRow row;
  row.key = key;
  row.version = version;
  row.gone = gone;
  row.bytes = std::move(bytes);
  return Commit([&] { return writer().PutSurfaceTile(row); });
}

}  // namespace strata::testing
