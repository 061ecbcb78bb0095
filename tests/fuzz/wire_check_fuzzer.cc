// The look at a request before it is parsed: whatever the bytes, a message takes no more memory
// than was foreseen, and what was refused was no message or above a bound.
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>

#include "server/rpc/wire_check.h"
#include "strata/v1/classifiers.pb.h"
#include "strata/v1/jobs.pb.h"
#include "strata/v1/maps.pb.h"
#include "strata/v1/planning.pb.h"
#include "strata/v1/posegraph.pb.h"
#include "strata/v1/scans.pb.h"
#include "strata/v1/tiles.pb.h"
#include "tests/fuzz/require.h"

namespace strata::fuzz {
namespace {

using google::protobuf::Message;

const Message& PrototypeOf(std::uint8_t kind) {
  static const std::array<const Message*, 13> prototypes = {
      &v1::CreateMapRequest::default_instance(),
      &v1::SetMapClassRequest::default_instance(),
      &v1::IngestScansRequest::default_instance(),
      &v1::UploadLocalMapRequest::default_instance(),
      &v1::ListScansRequest::default_instance(),
      &v1::FetchTilesRequest::default_instance(),
      &v1::PlanPathRequest::default_instance(),
      &v1::CheckPathRequest::default_instance(),
      &v1::StartJobRequest::default_instance(),
      &v1::AddConstraintRequest::default_instance(),
      &v1::LocalizeRequest::default_instance(),
      &v1::TrackRequest::default_instance(),
      &v1::ImportClassifierRequest::default_instance()};
  return *prototypes[kind % prototypes.size()];
}

}  // namespace
}  // namespace strata::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const google::protobuf::Message& prototype = strata::fuzz::PrototypeOf(data[0]);
  google::protobuf::io::ArrayInputStream stream(data + 1, static_cast<int>(size - 1));
  const absl::StatusOr<std::size_t> bytes =
      strata::server::ParsedBytes(*prototype.GetDescriptor(), stream);
  if (!bytes.ok()) {
    strata::fuzz::RequireGoodRefusal(bytes.status());
    return 0;
  }
  const std::unique_ptr<google::protobuf::Message> message(prototype.New());
  if (message->ParseFromArray(data + 1, static_cast<int>(size - 1))) {
    strata::fuzz::Require(message->SpaceUsedLong() <= *bytes, "what it takes was foreseen");
  }
  return 0;
}
