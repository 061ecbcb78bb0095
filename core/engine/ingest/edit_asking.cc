// Where another engine has the map: it is asked for an edit by the store that both use.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/blocking.h"
#include "core/common/guarded.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/engine/ingest/edits.h"
#include "core/storage/outcome.h"

namespace strata {
namespace {

constexpr absl::Duration kFirstPause = absl::Milliseconds(4);
constexpr absl::Duration kLongestPause = absl::Milliseconds(32);
constexpr absl::Duration kLookInterval = absl::Seconds(1);
// So long the store may be away.
constexpr absl::Duration kPatience = absl::Seconds(10);
// So long an edit waits (StorageWriter::PutEdit()).
constexpr absl::Duration kLongestWait = absl::Hours(1);

absl::Status NotInTime() {
  return absl::AbortedError("the server that has the map did not come to it within an hour");
}

// One edit that was asked for.
class AskedEdit {
 public:
  AskedEdit(MapStorage& store, std::uint64_t number) : store_(store), number_(number) {}

  // The answer; nullopt: none yet. An error: there will be none that could be read.
  absl::StatusOr<std::optional<absl::Status>> Look() {
    absl::StatusOr<std::optional<absl::Status>> answer = Read();
    if (absl::IsUnavailable(answer.status()) || absl::IsResourceExhausted(answer.status())) {
      if (SteadyNow() - last_read_ < kPatience) return std::nullopt;
      return OutcomeUnknown(answer.status().message());
    }
    last_read_ = SteadyNow();
    return absl::IsNotFound(answer.status()) ? WhyGone() : answer;
  }

  // `why`, or the answer where there is one.
  absl::Status Withdraw(const absl::Status& why) {
    StorageWriter& writer = store_.writer();
    bool waited = false;
    const absl::Status withdrawn = writer.Commit(Durability::kFull, [&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(waited, writer.WithdrawEdit(number_));
      return absl::OkStatus();
    });
    if (waited) return why;
    if (IsMapGone(withdrawn)) return MapGone();
    if (!withdrawn.ok()) return why;
    const absl::StatusOr<std::optional<absl::Status>> answer = Read();
    return answer.ok() && answer->has_value() ? **answer : why;
  }

  void Forget() {
    Guarded([&] {
      StorageWriter& writer = store_.writer();
      return writer.Commit(Durability::kRelaxed, [&] { return writer.ForgetEdit(number_); });
    }).IgnoreError();  // who asks next does, an hour later
  }

 private:
  // What the edit was of is there no more.
  static bool IsMapGone(const absl::Status& status) {
    return MustBeOpenedAnew(status) && !IsOutcomeUnknown(status);
  }
  static absl::Status MapGone() {
    return absl::NotFoundError("the map was deleted, and the edit with it");
  }
  absl::Status WhyGone() { return IsMapGone(store_.CheckInPlace()) ? MapGone() : NotInTime(); }
  absl::StatusOr<std::optional<absl::Status>> Read() {
    STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<StorageReader> reader, store_.NewReader());
    return reader->FindAnswer(number_);
  }

  MapStorage& store_;
  const std::uint64_t number_;
  absl::Time last_read_ = SteadyNow();
};

absl::Status AwaitAnswer(AskedEdit& asked,
                         const Stop& stop,
                         absl::FunctionRef<absl::Status()> look) {
  const BlockingScope blocking;
  const absl::Time end = SteadyNow() + kLongestWait;
  absl::Duration pause = kFirstPause;
  absl::Time next_look = SteadyNow() + kLookInterval;
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const std::optional<absl::Status> answer, asked.Look());
    if (answer.has_value()) return *answer;
    absl::Status goes_on = SteadyNow() < end ? stop.status() : NotInTime();
    if (goes_on.ok() && SteadyNow() >= next_look) {
      goes_on = look();
      next_look = SteadyNow() + kLookInterval;
    }
    if (!goes_on.ok()) {
      return asked.Withdraw(Annotate(goes_on, "waited for the server that has the map"));
    }
    absl::SleepFor(pause);
    pause = std::min(2 * pause, kLongestPause);
  }
}

}  // namespace

absl::Status AskForEdit(MapStorage& store,
                        const EditRequest& edit,
                        const Stop& stop,
                        absl::FunctionRef<absl::Status()> look) {
  StorageWriter& writer = store.writer();
  std::uint64_t number = 0;
  STRATA_RETURN_IF_ERROR(writer.Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(number, writer.PutEdit(edit));
    return absl::OkStatus();
  }));
  AskedEdit asked(store, number);
  absl::Status answer = AwaitAnswer(asked, stop, look);
  if (!IsOutcomeUnknown(answer)) asked.Forget();
  return answer;
}

}  // namespace strata
