#include "server/services/map_watch_reactor.h"

#include <algorithm>
#include <cstddef>
#include <type_traits>

#include "core/common/status.h"
#include "proto/translate/watch.h"

namespace strata::server {
namespace {

constexpr std::size_t kMaxPerMessage = 1024;

}  // namespace

absl::Status MapWatchReactor::Ask(const In& in) {
  map_ = in.name();
  once_ = in.once();
  resume_from_ = in.since();
  STRATA_ASSIGN_OR_RETURN(options_, AtTheDoor(translate::FromProto(in)));
  options_.once = true;
  return absl::OkStatus();
}

absl::StatusOr<MapWatchReactor::News> MapWatchReactor::Look(Out& out) {
  if (parts_.empty()) STRATA_RETURN_IF_ERROR(LookAtMap());
  if (parts_.empty()) return News::kNone;
  if (!out.ParseFromString(parts_.front())) return absl::InternalError("a part of an update");
  parts_bytes_ -= parts_.front().size();
  parts_.pop_front();
  if (!parts_.empty()) return News::kMore;
  return once_ ? News::kLast : News::kSome;
}

absl::Status MapWatchReactor::LookAtMap() {
  const auto take = [&](const api::MapUpdate& update) -> absl::Status {
    const bool news = update.commit_sequence != options_.since || update.epoch != options_.epoch ||
                      !update.scans.empty() || !update.tiles.empty();
    options_.since = update.commit_sequence;
    options_.epoch = update.epoch;
    if (!looked_ || news) AddParts(update);
    looked_ = true;
    options_.lag = api::kWatchLag;
    return absl::OkStatus();
  };
  const api::WatchOptions options = options_;
  return runtime().db.maps().Watch(request().call(), map_, options, take);
}

void MapWatchReactor::AddParts(const api::MapUpdate& update) {
  std::size_t scans_added = 0;
  std::size_t tiles_added = 0;
  const auto next = [](const auto& all, std::size_t& added) {
    const std::size_t begin = added;
    added = std::min(all.size(), added + kMaxPerMessage);
    using All = std::decay_t<decltype(all)>;
    return All(all.begin() + static_cast<std::ptrdiff_t>(begin),
               all.begin() + static_cast<std::ptrdiff_t>(added));
  };
  for (bool last = false; !last;) {
    api::MapUpdate part;
    part.epoch = update.epoch;
    if (scans_added == 0 && tiles_added == 0) {
      part.epoch_reason = update.epoch_reason;
      part.whole = update.whole;
      part.inferred = update.inferred;
    }
    part.scans = next(update.scans, scans_added);
    part.tiles = next(update.tiles, tiles_added);
    last = scans_added == update.scans.size() && tiles_added == update.tiles.size();
    if (last) resume_from_ = update.commit_sequence;
    part.commit_sequence = resume_from_;
    parts_.push_back(translate::ToProto(part).SerializeAsString());
    parts_bytes_ += parts_.back().size();
  }
}

absl::string_view MapWatchReactor::shutdown_message() const {
  return "the server is shutting down; resume after its restart";
}

}  // namespace strata::server
