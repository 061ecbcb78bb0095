#include "server/last_end.h"

#include <atomic>
#include <csignal>
#include <fstream>
#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <fcntl.h>
#include <unistd.h>

namespace strata::server {
namespace {

constexpr absl::string_view kFault = "fault\n";

std::atomic<int> run_file{-1};

// Only what a signal handler may do. The disposition is the default again: the signal, raised once
// more, ends the process as it would have.
void NoteFault(int signal) {
  const int file = run_file.load();
  if (file >= 0 && write(file, kFault.data(), kFault.size()) < 0) {
    // Whoever reads the file takes it for a death from outside.
  }
  raise(signal);
}

void NoteFaults() {
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
    struct sigaction now {};
    // A sanitizer, or whoever else is told already, keeps its own.
    if (sigaction(signal, nullptr, &now) != 0 || now.sa_handler != SIG_DFL) continue;
    struct sigaction note {};
    note.sa_handler = NoteFault;
    note.sa_flags = SA_RESETHAND;
    sigaction(signal, &note, nullptr);
  }
}

struct Machine {
  std::string boot;
  long oom_kills = -1;  // since then; < 0 where the kernel does not tell
};

Machine ThisMachine() {
  Machine machine;
  std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), machine.boot);
  std::ifstream counters("/proc/vmstat");
  for (std::string name, value; counters >> name >> value;) {
    if (name == "oom_kill" && !absl::SimpleAtoi(value, &machine.oom_kills)) machine.oom_kills = -1;
  }
  return machine;
}

}  // namespace

bool BeginRun(const std::filesystem::path& directory) {
  const std::filesystem::path path = directory / "stratad.run";
  std::ifstream last(path);
  std::string boot;
  long oom_kills = -1;
  last >> boot >> oom_kills;
  std::string fault;
  const bool noted = !last.fail() && !(last >> fault);
  const Machine machine = ThisMachine();
  const bool from_outside =
      noted && machine.oom_kills >= 0 && (boot != machine.boot || oom_kills == machine.oom_kills);

  // Whoever is killed here has one of both whole.
  const std::filesystem::path next = path.string() + ".new";
  const int file = open(next.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0640);
  if (file < 0) return false;
  const std::string line = absl::StrCat(machine.boot, " ", machine.oom_kills, "\n");
  if (write(file, line.data(), line.size()) != static_cast<ssize_t>(line.size()) ||
      rename(next.c_str(), path.c_str()) != 0) {
    close(file);
    return false;
  }
  run_file = file;
  NoteFaults();
  return from_outside;
}

}  // namespace strata::server
