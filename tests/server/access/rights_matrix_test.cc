// Every call of every service, for everyone who may knock.
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor_database.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include "proto/translate/status.h"
#include "server/access/method_rights.h"
#include "server/access/token.h"
#include "server/access/token_file.h"
#include "strata/v1/scans.grpc.pb.h"
#include "tests/server/new_grant.h"
#include "tests/server/raw_call.h"
#include "tests/server/served_mock.h"
#include "tests/support/temp_dir.h"

namespace strata::server {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Return;
using Code = absl::StatusCode;
using google::protobuf::DescriptorPool;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

constexpr char kMap[] = "campus";

// The right that a call should need, decided here once more: a new call belongs into both tables.
const std::map<std::string, std::optional<Right>>& Needed() {
  static const auto* const needed = [] {
    auto* all = new std::map<std::string, std::optional<Right>>();
    const auto add = [all](std::optional<Right> right, std::vector<std::string> methods) {
      for (std::string& method : methods) all->emplace(std::move(method), right);
    };
    add(std::nullopt, {"Maps.List"});  // anyone who is known
    add(Right::kRead,
        {"Maps.Get",
         "Maps.Stats",
         "Maps.History",
         "Maps.ListClasses",
         "Maps.Watch",
         "Scans.GetUploadState",
         "Scans.Get",
         "Scans.List",
         "Scans.GetPoints",
         "Scans.GetFaded",
         "Tiles.Get",
         "Tiles.List",
         "Tiles.Fetch",
         "Planning.PlanPath",
         "Planning.SampleSurfaces",
         "Planning.ListProfiles",
         "PoseGraph.Get",
         "PoseGraph.LookupPose",
         "PoseGraph.Localize",
         "PoseGraph.Track",
         "Jobs.Get",
         "Jobs.List",
         "Jobs.Watch",
         "Classifiers.Get",
         "Classifiers.List",
         "Classifiers.Export",
         "Planning.CheckPath",
         "Planning.ListFloors",
         "Planning.ListPlaces",
         "Planning.Explore",
         "Planning.CheckShape",
         "Models.GetPlaneModel",
         "Objects.ListEntities",
         "Objects.ListKinds",
         "Objects.GetKind",
         "Objects.ListInferred",
         "Planning.WatchPath"});
    add(Right::kWrite,
        {"Maps.SetClass",
         "Maps.SetOrigin",
         "Scans.Upload",
         "Scans.Ingest",
         "Scans.UploadLocalMap",
         "Scans.SetLabels",
         "Scans.Delete",
         "Planning.SetProfile",
         "PoseGraph.SetPose",
         "PoseGraph.AddConstraint",
         "PoseGraph.RemoveConstraint",
         "PoseGraph.EnableConstraint",
         "Jobs.Start",
         "Jobs.Cancel",
         "Jobs.Accept",
         "Jobs.Revert",
         "Objects.RenameKind",
         "Objects.ImportKind",
         "Objects.DeleteKind",
         "Classifiers.Delete",
         "Classifiers.Import"});
    add(Right::kAdmin, {"Maps.Create", "Maps.Delete", "Maps.Backup"});
    return all;
  }();
  return *needed;
}

std::string NameOf(const MethodDescriptor& method) {
  return absl::StrCat(method.service()->name(), ".", method.name());
}

// Of all files linked in.
std::vector<const MethodDescriptor*> AllMethods() {
  std::vector<std::string> files;
  EXPECT_TRUE(DescriptorPool::internal_generated_database()->FindAllFileNames(&files));
  std::vector<const MethodDescriptor*> methods;
  for (const std::string& name : files) {
    if (!absl::StartsWith(name, "strata/v1/")) continue;
    const auto* const file = DescriptorPool::generated_pool()->FindFileByName(name);
    for (int s = 0; s < file->service_count(); ++s) {
      for (int m = 0; m < file->service(s)->method_count(); ++m) {
        methods.push_back(file->service(s)->method(m));
      }
    }
  }
  return methods;
}

// Names the map in every way the contract has: `map`, `start.map`, or of Maps `name`.
bool NameMap(Message& message, const std::string& map) {
  const auto& type = *message.GetDescriptor();
  const bool of_maps = absl::StrContains(type.file()->name(), "maps.proto");
  for (const char* field : {"map", of_maps ? "name" : "map"}) {
    const FieldDescriptor* found = type.FindFieldByName(field);
    if (found == nullptr || found->cpp_type() != FieldDescriptor::CPPTYPE_STRING) continue;
    message.GetReflection()->SetString(&message, found, map);
    return true;
  }
  const FieldDescriptor* start = type.FindFieldByName("start");
  return start != nullptr && start->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE &&
         NameMap(*message.GetReflection()->MutableMessage(&message, start), map);
}

std::string RequestOf(const MethodDescriptor& method, const std::string& map) {
  const std::unique_ptr<Message> message(google::protobuf::MessageFactory::generated_factory()
                                             ->GetPrototype(method.input_type())
                                             ->New());
  NameMap(*message, map);
  return message->SerializeAsString();
}

class RightsMatrixTest : public ServedMock {
 protected:
  RightsMatrixTest() {
    // Else it watches for ever.
    ON_CALL(db_.maps(), Watch(_, _, _, _)).WillByDefault(Return(absl::UnknownError("no answer")));
  }

  // A grant's token; a file is written by Write().
  std::string Give(const std::string& name,
                   MapRights maps,
                   absl::Duration lifetime = absl::Hours(1)) {
    auto [grant, token] = NewGrant(name, std::move(maps));
    grant.expires = absl::Now() + lifetime;
    grants_.push_back(grant);
    return token;
  }
  void Write() { STRATA_ASSERT_OK(WriteTokenFile(file_, grants_)); }
  void ServeWithTokens() {
    Write();
    ServerOptions options;
    options.token_file = file_;
    Serve(options);
  }
  // What came of a call by whoever has `token`.
  absl::Status Knock(const MethodDescriptor& method,
                     const std::optional<std::string>& authorization,
                     const std::string& map = kMap) {
    std::map<std::string, std::string> metadata;
    if (authorization.has_value()) metadata["authorization"] = *authorization;
    const RawAnswer answer =
        CallRaw(channel_,
                absl::StrCat("/", method.service()->full_name(), "/", method.name()),
                RequestOf(method, map),
                metadata);
    // Ingest answers by scan.
    v1::IngestScansResponse scan;
    if (answer.status.ok() && NameOf(method) == "Scans.Ingest" && answer.messages.size() == 1 &&
        scan.ParseFromString(answer.messages.front()) && scan.has_error()) {
      return translate::FromScanError(scan.error());
    }
    return translate::FromGrpcStatus(answer.status);
  }
  // The error of someone refused is of the door, not of the database behind it.
  void ExpectRefused(const MethodDescriptor& method,
                     const std::optional<std::string>& authorization,
                     Code code,
                     const std::string& message) {
    const absl::Status status = Knock(method, authorization);
    EXPECT_THAT(status, StatusIs(code, HasSubstr(message)));
    // Of many strangers most are refused before there is anything to say more with.
    const bool stranger = code == Code::kUnauthenticated;
    EXPECT_THAT(ReasonOf(status), AnyOf("ACCESS", stranger ? "none" : "ACCESS"));
  }

  testing::TempDir dir_;
  const std::filesystem::path file_ = dir_.path() / "tokens.json";
  std::vector<Grant> grants_;
};

TEST_F(RightsMatrixTest, EveryCallHasARightAndNoOther) {
  std::set<std::string> names;
  for (const MethodDescriptor* method : AllMethods()) {
    const std::string name = NameOf(*method);
    names.insert(name);
    EXPECT_TRUE(Needed().contains(name)) << name << ": say here which right it needs";
    EXPECT_NE(FindMethodRight(name), nullptr)
        << name << ": nobody may call it; add it to server/access/method_rights.cc";
  }
  EXPECT_GE(names.size(), 43);
}

TEST_F(RightsMatrixTest, AMapIsFoundWhereTheTableSaysItIs) {
  for (const MethodDescriptor* method : AllMethods()) {
    SCOPED_TRACE(NameOf(*method));
    const MethodRight* row = FindMethodRight(NameOf(*method));
    ASSERT_NE(row, nullptr);
    const std::unique_ptr<Message> message(google::protobuf::MessageFactory::generated_factory()
                                               ->GetPrototype(method->input_type())
                                               ->New());
    EXPECT_EQ(NameMap(*message, kMap), !row->map_field.empty());
    if (row->map_field.empty()) continue;
    EXPECT_EQ(MapNamedIn(*message, row->map_field), kMap);
  }
}

TEST_F(RightsMatrixTest, WhoIsNotKnownGetsNowhere) {
  const std::string revoked = Give("revoked", {{kAllMaps, Right::kAdmin}});
  grants_.clear();
  const std::string expired = Give("expired", {{kAllMaps, Right::kAdmin}}, -absl::Seconds(1));
  const std::string good = Give("good", {{kAllMaps, Right::kAdmin}});
  const std::string unknown = NewToken()->ToString();
  // The id is no secret: with it alone nobody comes in.
  const std::string forged = good.substr(0, good.size() - 43) + unknown.substr(unknown.size() - 43);
  // Hundreds of refused calls within a second are cut off: each server hears less than that.
  constexpr int kMethodsOfServer = 25;
  int knocked = 0;
  for (const MethodDescriptor* method : AllMethods()) {
    if (knocked++ % kMethodsOfServer == 0) ServeWithTokens();
    SCOPED_TRACE(NameOf(*method));
    constexpr Code kUnknown = Code::kUnauthenticated;
    ExpectRefused(*method, std::nullopt, kUnknown, "wants a token");
    ExpectRefused(*method, "garbage", kUnknown, "is not 'Bearer '");
    ExpectRefused(*method, "Basic " + good, kUnknown, "is not 'Bearer '");
    ExpectRefused(*method, "Bearer", kUnknown, "is not 'Bearer '");
    ExpectRefused(*method, "Bearer " + good + "x", kUnknown, "is not 'Bearer '");
    ExpectRefused(*method, "Bearer " + unknown, kUnknown, "unknown or revoked");
    ExpectRefused(*method, "Bearer " + revoked, kUnknown, "unknown or revoked");
    ExpectRefused(*method, "Bearer " + forged, kUnknown, "unknown or revoked");
    ExpectRefused(*method, "Bearer " + expired, kUnknown, "expired at");
  }
}

TEST_F(RightsMatrixTest, ARightOpensWhatItIsForAndNothingElse) {
  struct Client {
    std::string token;
    std::optional<Right> right;  // on kMap
    std::string name;
  };
  std::vector<Client> clients;
  const auto add = [&](const std::string& name, MapRights maps, std::optional<Right> right) {
    clients.push_back({"Bearer " + Give(name, std::move(maps)), right, name});
  };
  const std::vector<Right> rights = {Right::kRead, Right::kWrite, Right::kAdmin};
  for (const Right right : rights) {
    const std::string name(RightName(right));
    add(name, {{kMap, right}}, right);
    add("all-" + name, {{kAllMaps, right}}, right);
    add("other-" + name, {{"harbour", right}}, std::nullopt);
  }
  add("mixed", {{kAllMaps, Right::kRead}, {kMap, Right::kWrite}}, Right::kWrite);
  add("other-mixed", {{kAllMaps, Right::kRead}, {"harbour", Right::kAdmin}}, Right::kRead);
  ServeWithTokens();
  for (const MethodDescriptor* method : AllMethods()) {
    const std::optional<Right> needed = Needed().at(NameOf(*method));
    for (const Client& client : clients) {
      SCOPED_TRACE(absl::StrCat(NameOf(*method), " by ", client.name));
      if (!needed.has_value() || (client.right.has_value() && *client.right >= *needed)) {
        const absl::Status status = Knock(*method, client.token);
        EXPECT_NE(ReasonOf(status), "ACCESS") << status;
      } else {
        ExpectRefused(*method,
                      client.token,
                      Code::kPermissionDenied,
                      absl::StrCat("'", RightName(*needed), "' on map campus"));
      }
    }
  }
}

TEST_F(RightsMatrixTest, AMapThatOneMayNotReadIsAsOneThatIsNotThere) {
  const std::string token = "Bearer " + Give("other", {{"harbour", Right::kAdmin}});
  ServeWithTokens();
  // The database tells a map that is there from one that is not: it is not asked.
  ON_CALL(db_.maps(), Get(_, absl::string_view(kMap))).WillByDefault(Return(MapInfo()));
  ON_CALL(db_.maps(), Get(_, absl::string_view("nowhere")))
      .WillByDefault(Return(absl::NotFoundError("map nowhere")));
  for (const MethodDescriptor* method : AllMethods()) {
    if (!Needed().at(NameOf(*method)).has_value()) continue;
    SCOPED_TRACE(NameOf(*method));
    const absl::Status there = Knock(*method, token, kMap);
    const absl::Status nowhere = Knock(*method, token, "nowhere");
    EXPECT_EQ(there.code(), Code::kPermissionDenied);
    EXPECT_EQ(there.code(), nowhere.code());
    EXPECT_EQ(absl::StrReplaceAll(there.message(), {{kMap, "nowhere"}}), nowhere.message());
    EXPECT_EQ(ReasonOf(there), ReasonOf(nowhere));
  }
}

TEST_F(RightsMatrixTest, WithoutTokensEveryCallGoesThrough) {
  Serve();
  for (const MethodDescriptor* method : AllMethods()) {
    SCOPED_TRACE(NameOf(*method));
    EXPECT_NE(ReasonOf(Knock(*method, std::nullopt)), "ACCESS");
  }
}

}  // namespace
}  // namespace strata::server
