#include "server/services/map_watch_reactor.h"

#include <algorithm>
#include <type_traits>

#include "core/common/status.h"
#include "proto/translate/watch.h"

namespace strata::server {
namespace {

constexpr std::size_t kMaxPerMessage = 1024;

}  // namespace

MapWatchReactor::MapWatchReactor(Runtime& runtime,
                                 grpc::CallbackServerContext& context,
                                 const v1::WatchMapRequest& in)
    : PollReactor(runtime, context, "Maps.Watch", in), in_(in), resume_from_(in.since()) {}

absl::StatusOr<MapWatchReactor::News> MapWatchReactor::Look(v1::WatchMapResponse& out) {
  if (updates_.empty()) STRATA_RETURN_IF_ERROR(LookAtMap());
  if (updates_.empty()) return News::kNone;
  TakePart(out);
  if (!updates_.empty()) return News::kMore;
  return in_.once() ? News::kLast : News::kSome;
}

absl::Status MapWatchReactor::LookAtMap() {
  const bool first = !options_.has_value();
  if (first) {
    STRATA_ASSIGN_OR_RETURN(options_, AtTheDoor(translate::FromProto(in_)));
    options_->once = true;
  }
  const auto take = [&](const api::MapUpdate& update) -> absl::Status {
    const bool news = update.commit_sequence != options_->since ||
                      update.epoch != options_->epoch || !update.scans.empty() ||
                      !update.tiles.empty();
    options_->since = update.commit_sequence;
    options_->epoch = update.epoch;
    if (first || news) updates_.push_back(update);
    return absl::OkStatus();
  };
  const api::WatchOptions options = *options_;
  return runtime().db.maps().Watch(request().call(), in_.name(), options, take);
}

void MapWatchReactor::TakePart(v1::WatchMapResponse& out) {
  const api::MapUpdate& update = updates_.front();
  const auto next = [](const auto& all, std::size_t& sent) {
    const std::size_t begin = sent;
    sent = std::min(all.size(), sent + kMaxPerMessage);
    using All = std::decay_t<decltype(all)>;
    return All(all.begin() + static_cast<std::ptrdiff_t>(begin),
               all.begin() + static_cast<std::ptrdiff_t>(sent));
  };
  api::MapUpdate part;
  part.epoch = update.epoch;
  if (scans_sent_ == 0 && tiles_sent_ == 0) {
    part.epoch_reason = update.epoch_reason;
    part.whole = update.whole;
  }
  part.scans = next(update.scans, scans_sent_);
  part.tiles = next(update.tiles, tiles_sent_);
  const bool last = scans_sent_ == update.scans.size() && tiles_sent_ == update.tiles.size();
  if (last) resume_from_ = update.commit_sequence;
  part.commit_sequence = resume_from_;
  out = translate::ToProto(part);
  if (!last) return;
  updates_.pop_front();
  scans_sent_ = tiles_sent_ = 0;
}

absl::string_view MapWatchReactor::shutdown_message() const {
  return "the server is shutting down; resume after its restart";
}

}  // namespace strata::server
