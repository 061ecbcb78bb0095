#include "tests/server/scan_sink.h"

#include <algorithm>
#include <cstdint>
#include <memory>

#include "absl/strings/str_cat.h"

#include "proto/translate/points.h"

namespace strata::server {
namespace {

// Points that are there of every announced scan.
constexpr std::uint64_t kHeld = 4;

}  // namespace

class ScanSink::Upload final : public api::ScanUpload {
 public:
  Upload(ScanSink& sink, const ScanHeader& header) : sink_(sink), header_(header) {}
  ~Upload() override {
    absl::MutexLock lock(&sink_.mutex_);
    if (!finished_) ++sink_.abandoned_;
  }

  std::uint64_t points_held() const override {
    return header_.content_hash.empty() ? 0 : std::min(kHeld, header_.point_count);
  }
  absl::Status Write(const PointCloud& chunk) override {
    points_ += chunk.size();
    return absl::OkStatus();
  }

  absl::StatusOr<ScanAck> Finish() override {
    absl::MutexLock lock(&sink_.mutex_);
    finished_ = true;
    if (header_.id.sequence == sink_.refused_) {
      return absl::AlreadyExistsError(absl::StrCat(header_.id.ToString(), " has other content"));
    }
    sink_.committed_.push_back(absl::StrCat(header_.id.ToString(), ": ", points_));
    return ScanAck{header_.id, sink_.committed_.size(), false, header_.content_hash};
  }

 private:
  ScanSink& sink_;
  const ScanHeader header_;
  std::size_t points_ = 0;
  bool finished_ = false;
};

ScanSink::ScanSink(::strata::testing::MockDatabase& db) {
  ON_CALL(db.scans(), Upload(::testing::_, ::testing::_, ::testing::_))
      .WillByDefault([this](const api::Call&, absl::string_view map, const ScanHeader& header)
                         -> absl::StatusOr<std::unique_ptr<api::ScanUpload>> {
        if (map != "campus") return absl::NotFoundError(absl::StrCat("map '", map, "'"));
        return std::make_unique<Upload>(*this, header);
      });
}

std::vector<std::string> ScanSink::committed() {
  absl::MutexLock lock(&mutex_);
  return committed_;
}

void ScanSink::AwaitAbandoned() {
  const auto abandoned = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return abandoned_ > 0; };
  absl::MutexLock lock(&mutex_, absl::Condition(&abandoned));
}

void ScanSink::Refuse(std::uint64_t sequence) {
  absl::MutexLock lock(&mutex_);
  refused_ = sequence;
}

v1::ScanStart StartOf(std::uint64_t sequence, std::uint64_t point_count) {
  v1::ScanStart start;
  start.set_map("campus");
  start.mutable_header()->mutable_id()->set_trajectory("run");
  start.mutable_header()->mutable_id()->set_sequence(sequence);
  start.mutable_header()->set_point_count(point_count);
  return start;
}

v1::PointChunk Points(std::size_t points) {
  PointCloud cloud;
  cloud.points.assign(points, Eigen::Vector3f(1.0F, 2.0F, 3.0F));
  return translate::ToProto(cloud);
}

}  // namespace strata::server
