#include "client/sdk/remote_classifiers.h"

#include <cstddef>
#include <string>
#include <utility>

#include "core/common/status.h"
#include "proto/translate/classifiers.h"

namespace strata::sdk {
namespace {

using translate::FromProto;

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

// A request that names a classifier.
template <typename Request>
Request Naming(absl::string_view map, absl::string_view name) {
  Request in;
  in.set_map(std::string(map));
  in.set_name(std::string(name));
  return in;
}

// One attempt.
absl::StatusOr<ClassifierInfo> SendClassifier(Connection& connection,
                                              v1::Classifiers::Stub& stub,
                                              const api::Call& call,
                                              absl::string_view map,
                                              absl::string_view name,
                                              absl::string_view bytes) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  AttemptContext context(connection, call);
  v1::ImportClassifierResponse out;
  const auto writer = stub.Import(context.get(), &out);
  v1::ImportClassifierRequest message;
  *message.mutable_start() = Naming<v1::ImportClassifierStart>(map, name);
  bool goes_on = writer->Write(message);
  for (std::size_t begin = 0; goes_on && begin < bytes.size(); begin += kPieceBytes) {
    message.set_bytes(std::string(bytes.substr(begin, kPieceBytes)));
    goes_on = writer->Write(message);
  }
  // The server refuses early by ending the stream; why is in its status.
  if (goes_on) writer->WritesDone();
  STRATA_RETURN_IF_ERROR(StatusOf(writer->Finish(), call));
  return FromProto(out.classifier());
}

}  // namespace

absl::StatusOr<ClassifierInfo> RemoteClassifiers::Get(const api::Call& call,
                                                      absl::string_view map,
                                                      absl::string_view name) {
  STRATA_ASSIGN_OR_RETURN(const v1::GetClassifierResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Classifiers::Stub::Get,
                                    call,
                                    Repeat::kOnTrouble,
                                    Naming<v1::GetClassifierRequest>(map, name)));
  return FromProto(out.classifier());
}

absl::StatusOr<std::vector<ClassifierInfo>> RemoteClassifiers::List(const api::Call& call,
                                                                    absl::string_view map) {
  v1::ListClassifiersRequest in;
  in.set_map(std::string(map));
  STRATA_ASSIGN_OR_RETURN(
      const v1::ListClassifiersResponse out,
      CallUnary(connection_, *stub_, &v1::Classifiers::Stub::List, call, Repeat::kOnTrouble, in));
  std::vector<ClassifierInfo> all;
  for (const v1::Classifier& classifier : out.classifiers()) {
    STRATA_ASSIGN_OR_RETURN(ClassifierInfo info, FromProto(classifier));
    all.push_back(std::move(info));
  }
  return all;
}

absl::Status RemoteClassifiers::Delete(const api::Call& call,
                                       absl::string_view map,
                                       absl::string_view name) {
  return CallUnary(connection_,
                   *stub_,
                   &v1::Classifiers::Stub::Delete,
                   call,
                   Repeat::kNever,
                   Naming<v1::DeleteClassifierRequest>(map, name))
      .status();
}

absl::Status RemoteClassifiers::Export(const api::Call& call,
                                       absl::string_view map,
                                       absl::string_view name,
                                       absl::FunctionRef<absl::Status(absl::string_view)> sink) {
  return CallStream(connection_,
                    *stub_,
                    &v1::Classifiers::Stub::Export,
                    call,
                    Naming<v1::ExportClassifierRequest>(map, name),
                    [&sink](const v1::ExportClassifierResponse& out) { return sink(out.bytes()); });
}

// Again only where another server has the map: nothing has happened then.
absl::StatusOr<ClassifierInfo> RemoteClassifiers::Import(const api::Call& call,
                                                         absl::string_view map,
                                                         absl::string_view name,
                                                         absl::string_view bytes) {
  Backoff backoff = connection_.NewBackoff();
  Route<v1::Classifiers::Stub> route(connection_, *stub_);
  while (true) {
    const absl::StatusOr<ClassifierInfo> made =
        SendClassifier(connection_, route.stub(), call, map, name, bytes);
    if (!MapOwnerOf(made.status()).has_value()) return made;
    route.Follow(made.status(), backoff);
    if (!backoff.Wait(made.status(), call.stop)) return made;
  }
}

}  // namespace strata::sdk
