// A real stratad of its own process.
#ifndef STRATA_TESTS_INTEGRATION_STRATAD_PROCESS_H_
#define STRATA_TESTS_INTEGRATION_STRATAD_PROCESS_H_

#include <cstdio>
#include <string>
#include <vector>

#include <sys/types.h>

namespace strata::testing {

// Runs a program with `arguments`; its stderr is the test's. It is killed when the thread that
// started it ends.
class ChildProcess {
 public:
  ChildProcess(const std::string& program, const std::vector<std::string>& arguments);
  // Kills what still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  // The next line of its stdout without the newline; empty at its end.
  std::string ReadLine();
  void Signal(int signal) const;
  pid_t pid() const { return pid_; }
  // Waits for its end: its exit code, or minus the signal that ended it.
  int Wait();

 private:
  pid_t pid_ = -1;
  std::FILE* stdout_ = nullptr;
};

class StratadProcess : public ChildProcess {
 public:
  explicit StratadProcess(const std::vector<std::string>& arguments);
  // By way of another program, which becomes a stratad: `arguments` are that one's.
  StratadProcess(const std::string& program, const std::vector<std::string>& arguments)
      : ChildProcess(program, arguments) {}
  // HOST:PORT out of "listening HOST:PORT", read once.
  const std::string& Address();

 private:
  std::string address_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_STRATAD_PROCESS_H_
