// A database that takes scans and nothing else, with troubles to order.
#ifndef STRATA_TESTS_CLIENT_CLI_SCAN_FAKE_SCANS_H_
#define STRATA_TESTS_CLIENT_CLI_SCAN_FAKE_SCANS_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/api/database.h"

namespace strata::cli {

// Thread-safe. Keeps the points of finished uploads in the order in which they were finished.
class FakeScans : public api::Scans {
 public:
  // Finish() of a scan answers with these first.
  std::map<std::uint64_t, std::vector<absl::Status>> troubles;
  std::vector<std::pair<ScanHeader, std::size_t>> finished;
  std::size_t largest_chunk = 0;

  absl::StatusOr<std::unique_ptr<api::ScanUpload>> Upload(const api::Call& /*call*/,
                                                          absl::string_view /*map*/,
                                                          const ScanHeader& header) override {
    return std::make_unique<FakeUpload>(*this, header);
  }
  absl::StatusOr<ScanAck> UploadLocalMap(const api::Call& /*call*/,
                                         absl::string_view /*map*/,
                                         const ScanHeader& /*header*/,
                                         const MlsParameters& /*parameters*/,
                                         absl::string_view /*local_map*/) override {
    return absl::UnimplementedError("");
  }
  absl::StatusOr<UploadState> GetUploadState(const api::Call& /*call*/,
                                             absl::string_view /*map*/,
                                             absl::string_view /*trajectory*/) override {
    return absl::UnimplementedError("");
  }
  absl::StatusOr<ScanInfo> Get(const api::Call& /*call*/,
                               absl::string_view /*map*/,
                               const ScanId& /*id*/) override {
    return absl::UnimplementedError("");
  }
  absl::Status List(const api::Call& /*call*/,
                    absl::string_view /*map*/,
                    const api::ScanFilter& /*filter*/,
                    absl::FunctionRef<absl::Status(const ScanInfo&)> /*sink*/) override {
    return absl::UnimplementedError("");
  }
  absl::Status GetPoints(const api::Call& /*call*/,
                         absl::string_view /*map*/,
                         const ScanId& /*id*/,
                         absl::FunctionRef<absl::Status(const PointCloud&)> /*sink*/) override {
    return absl::UnimplementedError("");
  }
  absl::StatusOr<std::vector<std::uint16_t>> GetFaded(const api::Call& /*call*/,
                                                      absl::string_view /*map*/,
                                                      const ScanId& /*id*/) override {
    return absl::UnimplementedError("");
  }
  absl::Status SetLabels(const api::Call& /*call*/,
                         absl::string_view /*map*/,
                         const ScanId& /*id*/,
                         const std::vector<std::uint16_t>& /*labels*/,
                         api::LabelMode /*mode*/) override {
    return absl::UnimplementedError("");
  }
  absl::Status Delete(const api::Call& /*call*/,
                      absl::string_view /*map*/,
                      const ScanId& /*id*/) override {
    return absl::UnimplementedError("");
  }

 private:
  class FakeUpload : public api::ScanUpload {
   public:
    FakeUpload(FakeScans& scans, ScanHeader header) : scans_(scans), header_(std::move(header)) {}
    absl::Status Write(const PointCloud& chunk) override {
      points_ += chunk.size();
      const std::lock_guard lock(scans_.mutex_);
      scans_.largest_chunk = std::max(scans_.largest_chunk, chunk.size());
      return absl::OkStatus();
    }
    absl::StatusOr<ScanAck> Finish() override {
      const std::lock_guard lock(scans_.mutex_);
      std::vector<absl::Status>& waiting = scans_.troubles[header_.id.sequence];
      if (!waiting.empty()) {
        const absl::Status trouble = waiting.front();
        waiting.erase(waiting.begin());
        return trouble;
      }
      scans_.finished.emplace_back(header_, points_);
      return ScanAck{header_.id, scans_.finished.size(), false, header_.content_hash};
    }

   private:
    FakeScans& scans_;
    ScanHeader header_;
    std::size_t points_ = 0;
  };

  std::mutex mutex_;
};

// Only scans() may be called.
class FakeDatabase : public api::Database {
 public:
  FakeScans fake_scans;

  api::Scans& scans() override { return fake_scans; }
  api::Maps& maps() override { std::abort(); }
  api::Tiles& tiles() override { std::abort(); }
  api::Planning& planning() override { std::abort(); }
  api::Jobs& jobs() override { std::abort(); }
  api::PoseGraph& posegraph() override { std::abort(); }
  api::Classifiers& classifiers() override { std::abort(); }
  api::Models& models() override { std::abort(); }
  api::Objects& objects() override { std::abort(); }
};

}  // namespace strata::cli

#endif  // STRATA_TESTS_CLIENT_CLI_SCAN_FAKE_SCANS_H_
