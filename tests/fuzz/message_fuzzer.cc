// What a peer's messages become: requests at the server, answers in the SDK. Any message is refused
// for a reason or taken, and what was taken can be said again.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <type_traits>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <google/protobuf/message.h>
#include <grpcpp/support/status.h>

#include "core/common/retry_delay.h"
#include "proto/translate/classifiers.h"
#include "proto/translate/jobs.h"
#include "proto/translate/localize.h"
#include "proto/translate/maps.h"
#include "proto/translate/models.h"
#include "proto/translate/objects.h"
#include "proto/translate/places.h"
#include "proto/translate/planning.h"
#include "proto/translate/points.h"
#include "proto/translate/posegraph.h"
#include "proto/translate/scans.h"
#include "proto/translate/shape.h"
#include "proto/translate/status.h"
#include "proto/translate/tiles.h"
#include "proto/translate/track.h"
#include "proto/translate/watch.h"
#include "tests/fuzz/proto_mutator.h"
#include "tests/fuzz/require.h"

namespace strata::fuzz {
namespace {

using google::protobuf::Message;

template <typename Value>
concept Sayable = requires(const Value& value) {
  translate::ToProto(value);
};

template <typename MessageType>
void TryMessage(const Message& message) {
  const auto value = translate::FromProto(static_cast<const MessageType&>(message));
  if constexpr (requires { value.status(); }) {
    RequireGoodRefusal(value.status());
    if constexpr (Sayable<decltype(*value)>) {
      if (!value.ok()) return;
      const auto said = translate::ToProto(*value);
      if constexpr (std::is_same_v<std::remove_cv_t<decltype(said)>, MessageType>) {
        Require(translate::FromProto(said).ok(), "what was taken can be said again");
      }
    }
  }
}

// A refusal that a peer sends may have any code and text, but is a refusal.
void TryScanError(const Message& message) {
  const auto& error = static_cast<const v1::ScanError&>(message);
  const absl::Status status = translate::FromScanError(error);
  Require(!status.ok(), "an error is one");
  RetryDelayOf(status);
}

// As details of a status, where they need not be of our kind.
void TryDetail(const Message& message) {
  const auto& detail = static_cast<const v1::ErrorDetail&>(message);
  const grpc::Status status(
      grpc::StatusCode::RESOURCE_EXHAUSTED, "full", detail.SerializePartialAsString());
  const absl::Status understood = translate::FromGrpcStatus(status);
  Require(absl::IsResourceExhausted(understood), "a status keeps its code");
  RetryDelayOf(understood);
  translate::ToGrpcStatus(understood, "request");
}

struct Kind {
  const Message& prototype;
  void (*attempt)(const Message&);
};

template <typename MessageType>
Kind KindOf() {
  return {MessageType::default_instance(), TryMessage<MessageType>};
}

const auto& Kinds() {
  static const auto* const kinds = new auto(std::to_array<Kind>({
      KindOf<v1::Classifier>(),
      KindOf<v1::Job>(),
      KindOf<v1::LocalizeStart>(),
      KindOf<v1::LocalizeResponse>(),
      KindOf<v1::TrackStart>(),
      KindOf<v1::TrackStep>(),
      KindOf<v1::TrackResponse>(),
      KindOf<v1::MapInfo>(),
      KindOf<v1::MapStats>(),
      KindOf<v1::MapClass>(),
      KindOf<v1::MapParameters>(),
      KindOf<v1::BackupMapResponse>(),
      KindOf<v1::PlanPathRequest>(),
      KindOf<v1::PlanPathResponse>(),
      KindOf<v1::SurfaceColumn>(),
      KindOf<v1::PathCheck>(),
      KindOf<v1::CheckPathRequest>(),
      KindOf<v1::WatchPathRequest>(),
      KindOf<v1::ListFloorsRequest>(),
      KindOf<v1::ListFloorsResponse>(),
      KindOf<v1::ListPlacesRequest>(),
      KindOf<v1::ListPlacesResponse>(),
      KindOf<v1::ExploreRequest>(),
      KindOf<v1::ExploreResponse>(),
      KindOf<v1::CheckShapeRequest>(),
      KindOf<v1::CheckShapeResponse>(),
      KindOf<v1::ModelPlane>(),
      KindOf<v1::PlaneModel>(),
      KindOf<v1::Entity>(),
      KindOf<v1::EntitySearch>(),
      KindOf<v1::ListEntitiesRequest>(),
      KindOf<v1::KindInfo>(),
      KindOf<v1::KindShape>(),
      KindOf<v1::InferredPart>(),
      KindOf<v1::InferredSearch>(),
      KindOf<v1::ListInferredRequest>(),
      KindOf<v1::PointChunk>(),
      KindOf<v1::PoseNode>(),
      KindOf<v1::Constraint>(),
      KindOf<v1::GlobalPlane>(),
      KindOf<v1::LookupPoseResponse>(),
      KindOf<v1::ScanHeader>(),
      KindOf<v1::ScanInfo>(),
      KindOf<v1::ScanAck>(),
      KindOf<v1::GetUploadStateResponse>(),
      KindOf<v1::ListScansRequest>(),
      KindOf<v1::TileKey>(),
      KindOf<v1::EncodedTile>(),
      KindOf<v1::TileInfo>(),
      KindOf<v1::TileArea>(),
      KindOf<v1::HeldTile>(),
      KindOf<v1::FetchTilesResponse>(),
      KindOf<v1::Epoch>(),
      KindOf<v1::WatchMapRequest>(),
      KindOf<v1::ScanChange>(),
      KindOf<v1::TileChange>(),
      KindOf<v1::WatchMapResponse>(),
      {v1::ScanError::default_instance(), TryScanError},
      {v1::ErrorDetail::default_instance(), TryDetail},
  }));
  return *kinds;
}

const Kind& KindOf(const std::uint8_t* data) { return Kinds()[data[0] % Kinds().size()]; }

// A byte for the kind, then the message.
std::pair<std::unique_ptr<Message>, bool> ReadMessage(const std::uint8_t* data, std::size_t size) {
  std::unique_ptr<Message> message(KindOf(data).prototype.New());
  const bool whole = message->ParseFromArray(data + 1, static_cast<int>(size - 1));
  return {std::move(message), whole};
}

}  // namespace
}  // namespace strata::fuzz

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data,
                                               std::size_t size,
                                               std::size_t max_size,
                                               unsigned int seed) {
  std::minstd_rand random(seed);
  if (size == 0 || random() % 64 == 0) {
    data[0] = static_cast<std::uint8_t>(random());
    return 1;
  }
  const auto message = strata::fuzz::ReadMessage(data, size).first;
  for (unsigned i = 0; i < 1 + seed % 4; ++i) strata::fuzz::Mutate(*message, random);
  const std::string bytes = message->SerializePartialAsString();
  if (bytes.size() + 1 > max_size) return size;
  std::memcpy(data + 1, bytes.data(), bytes.size());
  return bytes.size() + 1;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto [message, whole] = strata::fuzz::ReadMessage(data, size);
  if (whole) strata::fuzz::KindOf(data).attempt(*message);
  return 0;
}
