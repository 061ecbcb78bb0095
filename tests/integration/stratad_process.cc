#include "tests/integration/stratad_process.h"

#include <array>
#include <csignal>
#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/paths.h"

namespace strata::testing {

ChildProcess::ChildProcess(const std::string& program, const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::array<int, 2> ends{};
  // Not for the children that other threads start at this time: one that lives on would keep this
  // one's output open.
  EXPECT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
  pid_ = fork();
  if (pid_ == 0) {  // only async-signal-safe calls until exec
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(ends[1], STDOUT_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(ends[1]);
  stdout_ = fdopen(ends[0], "r");
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) {
    Signal(SIGKILL);
    Wait();
  }
  std::fclose(stdout_);
}

std::string ChildProcess::ReadLine() {
  std::string line;
  for (int c = std::fgetc(stdout_); c != EOF && c != '\n'; c = std::fgetc(stdout_)) {
    line.push_back(static_cast<char>(c));
  }
  return line;
}

StratadProcess::StratadProcess(const std::vector<std::string>& arguments)
    : ChildProcess(StratadProgram(), arguments) {}

const std::string& StratadProcess::Address() {
  const std::string prefix = "listening ";
  if (address_.empty()) {
    const std::string line = ReadLine();
    EXPECT_EQ(line.substr(0, prefix.size()), prefix);
    if (line.size() > prefix.size()) address_ = line.substr(prefix.size());
  }
  return address_;
}

void ChildProcess::Signal(int signal) const {
  if (pid_ > 0) kill(pid_, signal);  // -1 would be everybody
}

int ChildProcess::Wait() {
  int status = 0;
  EXPECT_EQ(waitpid(pid_, &status, 0), pid_);
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

}  // namespace strata::testing
