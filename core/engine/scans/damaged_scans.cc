#include "core/engine/scans/damaged_scans.h"

#include <cstddef>

#include "absl/strings/str_cat.h"

namespace strata {
namespace {

constexpr std::size_t kNamed = 10;

}  // namespace

bool DamagedScans::LeaveOut(ScanNumber scan, const std::string& name, const absl::Status& status) {
  if (!absl::IsDataLoss(status)) return false;
  absl::MutexLock lock(&mutex_);
  scans_.insert({scan, {name, std::string(status.message())}});
  return true;
}

bool DamagedScans::LeaveOut(StorageReader& reader,
                            ScanNumber scan,
                            const std::string& name,
                            const absl::Status& status) {
  if (!absl::IsDataLoss(status)) return false;
  if (!absl::IsNotFound(reader.GetScan(scan, 0).status())) return LeaveOut(scan, name, status);
  absl::MutexLock lock(&mutex_);
  deleted_.insert(scan);
  return true;
}

std::set<ScanNumber> DamagedScans::Scans() const {
  absl::MutexLock lock(&mutex_);
  std::set<ScanNumber> numbers = deleted_;
  for (const auto& [scan, damage] : scans_) numbers.insert(scan);
  return numbers;
}

void DamagedScans::SetMetrics(JobContext& context) const {
  absl::MutexLock lock(&mutex_);
  context.SetMetric("left_out", static_cast<double>(scans_.size()));
  for (const auto& [scan, damage] : scans_) {
    context.SetMetric(absl::StrCat("left_out.", damage.name), 1.0);
  }
}

std::string DamagedScans::Message() const {
  absl::MutexLock lock(&mutex_);
  if (scans_.empty()) return "";
  std::string text = absl::StrCat(
      "; ", scans_.size(), scans_.size() == 1 ? " damaged scan" : " damaged scans", " left out: ");
  std::size_t named = 0;
  for (const auto& [scan, damage] : scans_) {
    if (named == kNamed) {
      absl::StrAppend(&text, ", and ", scans_.size() - kNamed, " more");
      break;
    }
    absl::StrAppend(&text, named++ == 0 ? "" : ", ", damage.name, " (", damage.what, ")");
  }
  return absl::StrCat(text, "; delete and upload again, or put back a copy of the map's file");
}

}  // namespace strata
