#include "client/cli/scan/spool_commands.h"

#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "client/cli/terminal/arguments.h"
#include "client/sdk/spool.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

void Put(const SpoolStatus& status, Json& json) {
  json["waiting"] = status.waiting;
  json["waiting_bytes"] = status.waiting_bytes;
  json["refused"] = status.refused;
  json["damaged"] = status.damaged;
}

absl::Status Status(FileContext& context, const std::string& directory) {
  STRATA_ASSIGN_OR_RETURN(const SpoolStatus status, Spool::Look(directory));
  Json json = {{"spool", directory}};
  Put(status, json);
  context.output.Object(json);
  return absl::OkStatus();
}

absl::Status Send(Context& context, const std::string& directory) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<Spool> spool, Spool::Open(directory));
  const absl::Status sent = spool->Send(context.call, context.database);
  const SpoolStatus status = spool->status();
  Json json = {{"spool", directory}, {"sent", status.sent}};
  Put(status, json);
  context.output.Object(json);
  return sent;
}

absl::Status AddOne(const UploadSource& source, const std::string& map, Spool& spool) {
  STRATA_ASSIGN_OR_RETURN(PointCloud cloud, source.read());
  const ScanHeader header = HeaderFor(source, cloud);
  cloud.origin.setZero();  // it is in the header now
  return spool.Add(map, header, cloud);
}

}  // namespace

absl::Status ImportIntoSpool(FileContext& context,
                             const std::string& directory,
                             const std::string& map,
                             const std::vector<UploadSource>& sources,
                             Json& result) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<Spool> spool, Spool::Open(directory));
  const std::vector<ScanId> waiting = spool->Waiting(map);
  const std::set<ScanId> known(waiting.begin(), waiting.end());
  std::uint64_t added = 0;
  for (const UploadSource& source : sources) {
    STRATA_RETURN_IF_ERROR(context.stop.status());
    if (known.count(source.header.id) > 0) continue;
    const absl::Status status = AddOne(source, map, *spool);
    if (absl::IsResourceExhausted(status)) return status;
    if (!status.ok()) {
      result["errors"].push_back({{"scan", source.file}, {"error", std::string(status.message())}});
      continue;
    }
    ++added;
  }
  const absl::StatusOr<std::unique_ptr<api::Database>> database = context.open_database();
  api::Call call;
  call.stop = context.stop;
  const absl::Status sent = database.ok() ? spool->Send(call, **database) : database.status();
  const SpoolStatus status = spool->status();
  result["added"] = added;
  result["sent"] = status.sent;
  Put(status, result);
  if (!sent.ok()) {
    context.output.Talk(absl::StrCat(status.waiting,
                                     " scans wait in ",
                                     directory,
                                     " (",
                                     sent.message(),
                                     "); strata spool send ",
                                     directory,
                                     " goes on with them"));
  }
  return absl::OkStatus();
}

void AddSpoolCommands(Commands& commands) {
  CLI::App* noun = commands.Noun("spool",
                                 "Scans on this disk that no server has acknowledged yet; scan "
                                 "import --spool puts them there",
                                 "strata spool status /var/spool/strata");
  auto directory = std::make_shared<std::string>();
  CLI::App* status =
      commands.FileVerb(noun,
                        "status",
                        "How many scans wait, were refused or are damaged",
                        "strata spool status /var/spool/strata --output json",
                        [directory](FileContext& context) { return Status(context, *directory); });
  CLI::App* send =
      commands.Verb(noun,
                    "send",
                    "Send what waits, in order; what the server refuses for good is set aside in "
                    "refused/ with the reason",
                    "strata spool send /var/spool/strata",
                    [directory](Context& context) { return Send(context, *directory); });
  for (CLI::App* verb : {status, send}) {
    verb->add_option("DIR", *directory, "Directory of the spool")->required();
  }
}

}  // namespace strata::cli
