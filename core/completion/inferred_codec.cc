#include "core/completion/inferred_codec.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include <Eigen/Core>

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/common/status.h"

namespace strata {
namespace {

using Eigen::Vector3d;

constexpr std::uint16_t kInferredVersion = 1;
constexpr double kTicksPerMetre = 1e4;
constexpr std::int64_t kMostTicks = 10'000'000'000'000;  // a million kilometres
constexpr std::size_t kLeastPointBytes = 3;

absl::Status DamagedInferred() {
  return absl::DataLossError("inferred: a number is out of range, or bytes are cut short");
}

std::int64_t TicksOf(double metres) {
  const double ticks = metres * kTicksPerMetre;
  const auto most = static_cast<double>(kMostTicks);
  // What is not a number becomes what no reader takes.
  return std::abs(ticks) <= most ? std::llround(ticks) : kMostTicks + 1;
}

}  // namespace

std::string EncodeInferredInfo(const InferredInfo& info) {
  std::string body;
  PutVarint(body, info.job);
  PutVarint(body, info.epoch);
  PutFixed(body, absl::ToUnixMicros(info.made));
  PutVarint(body, info.kinds);
  PutVarint(body, info.entities);
  PutVarint(body, info.points);
  return SealBlob(BlobKind::kInferredHead, kInferredVersion, body);
}

absl::StatusOr<InferredInfo> DecodeInferredInfo(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kInferredHead, kInferredVersion, bytes));
  ByteReader in(body);
  InferredInfo info;
  info.job = in.Varint();
  info.epoch = in.Varint();
  info.made = absl::FromUnixMicros(in.Fixed<std::int64_t>());
  info.kinds = in.Varint();
  info.entities = in.Varint();
  info.points = in.Varint();
  if (!in.ok() || in.remaining() != 0) return DamagedInferred();
  return info;
}

std::string EncodeInferredPart(const InferredPart& part) {
  std::string body;
  PutVarint(body, part.entity);
  PutVarint(body, part.kind);
  PutVarint(body, part.agreeing);
  PutVarint(body, part.contradicting);
  PutVarint(body, part.points.size());
  std::array<std::int64_t, 3> before = {};
  for (const Vector3d& p : part.points) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int64_t ticks = TicksOf(p[static_cast<Eigen::Index>(i)]);
      PutVarint(body, ZigZag(ticks - before[i]));
      before[i] = ticks;
    }
  }
  return SealBlob(BlobKind::kInferred, kInferredVersion, body);
}

absl::StatusOr<InferredPart> DecodeInferredPart(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kInferred, kInferredVersion, bytes));
  ByteReader in(body);
  InferredPart part;
  part.entity = in.Varint();
  part.kind = in.Varint();
  part.agreeing = in.Varint();
  part.contradicting = in.Varint();
  const std::uint64_t points = in.Varint();
  if (!in.ok() || points > kMostInferredPoints || points > in.remaining() / kLeastPointBytes) {
    return DamagedInferred();
  }
  part.points.reserve(points);
  std::array<std::int64_t, 3> ticks = {};
  for (std::uint64_t k = 0; k < points; ++k) {
    Vector3d& p = part.points.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int64_t step = UnZigZag(in.Varint());
      if (std::abs(step / 2) > kMostTicks) return DamagedInferred();
      ticks[i] += step;
      if (std::abs(ticks[i]) > kMostTicks) return DamagedInferred();
      p[static_cast<Eigen::Index>(i)] = static_cast<double>(ticks[i]) / kTicksPerMetre;
    }
  }
  if (!in.ok() || in.remaining() != 0) return DamagedInferred();
  return part;
}

}  // namespace strata
