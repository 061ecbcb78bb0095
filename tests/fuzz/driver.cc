// Runs a fuzzer where there is no libFuzzer: the sanitized build of the gate, which has all its
// libraries anyway. It learns nothing from coverage; what a campaign with libFuzzer has learned is
// in the corpus, all of which is run, and then changed at random.
//
// Takes folders and files, and those of libFuzzer's options that run.sh gives.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include <fcntl.h>
#include <unistd.h>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" __attribute__((weak)) std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data,
                                                                     std::size_t size,
                                                                     std::size_t max_size,
                                                                     unsigned int seed);
// Of the sanitizers, where there are any.
extern "C" __attribute__((weak)) void __sanitizer_set_death_callback(void (*callback)());

namespace strata::fuzz {
namespace {

constexpr std::size_t kMostBytes = 4096;
constexpr unsigned kMostSeconds = 60;  // that an input may take

struct Options {
  int seconds = 0;  // of changed inputs
  unsigned seed = 1;
  std::string artifact_prefix;
  std::vector<std::filesystem::path> inputs;
};

std::string current;   // input
std::string crash_to;  // file

void KeepInput() {
  const int file = open(crash_to.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0644);
  const bool kept = write(file, current.data(), current.size()) >= 0;
  close(file);
  constexpr char kText[] = "\nthe input is kept: see -artifact_prefix\n";
  if (kept && write(STDERR_FILENO, kText, sizeof(kText) - 1) < 0) _exit(1);
}

void EndBySignal(int signal) {
  KeepInput();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void Run(std::string input) {
  current = std::move(input);
  alarm(kMostSeconds);
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(current.data()), current.size());
}

// One small change, at times with bytes of `other`.
void Change(std::string& bytes, const std::string& other, std::minstd_rand& random) {
  const std::size_t at = random() % (bytes.size() + 1);
  const std::size_t count = 1 + random() % 8;
  switch (random() % 5) {
    case 0:
      if (at < bytes.size()) bytes[at] ^= static_cast<char>(1 << (random() % 8));
      return;
    case 1:
      if (at < bytes.size()) bytes[at] = static_cast<char>(random());
      return;
    case 2:
      bytes.erase(at, count);
      return;
    case 3:
      bytes.insert(at, count, static_cast<char>(random()));
      return;
    default:
      if (!other.empty()) bytes.insert(at, other, random() % other.size(), 4 * count);
  }
}

std::string Changed(std::string bytes, const std::string& other, std::minstd_rand& random) {
  if (LLVMFuzzerCustomMutator != nullptr) {
    const std::size_t size = bytes.size();
    bytes.resize(std::max(size, kMostBytes));
    auto* data = reinterpret_cast<std::uint8_t*>(bytes.data());
    bytes.resize(LLVMFuzzerCustomMutator(data, size, bytes.size(), random()));
  } else {
    const unsigned changes = 1 + random() % 4;
    for (unsigned i = 0; i < changes; ++i) Change(bytes, other, random);
  }
  return bytes;
}

std::vector<std::string> ReadInputs(const std::vector<std::filesystem::path>& paths) {
  std::vector<std::filesystem::path> files;
  for (const std::filesystem::path& path : paths) {
    if (!std::filesystem::is_directory(path)) {
      files.push_back(path);
      continue;
    }
    for (const auto& entry : std::filesystem::directory_iterator(path)) files.push_back(entry);
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> inputs;
  for (const std::filesystem::path& file : files) {
    std::ifstream stream(file, std::ios::binary);
    inputs.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  }
  return inputs;
}

Options ReadOptions(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    absl::string_view word = argv[i];
    if (absl::ConsumePrefix(&word, "-max_total_time=")) {
      if (!absl::SimpleAtoi(word, &options.seconds)) std::exit(2);
    } else if (absl::ConsumePrefix(&word, "-seed=")) {
      if (!absl::SimpleAtoi(word, &options.seed)) std::exit(2);
    } else if (absl::ConsumePrefix(&word, "-artifact_prefix=")) {
      options.artifact_prefix = std::string(word);
    } else if (word.empty() || word[0] != '-') {
      options.inputs.emplace_back(argv[i]);
    }
  }
  return options;
}

int Main(const Options& options) {
  crash_to = options.artifact_prefix + "crash";
  if (__sanitizer_set_death_callback != nullptr) __sanitizer_set_death_callback(KeepInput);
  std::signal(SIGABRT, EndBySignal);
  std::signal(SIGALRM, EndBySignal);
  std::vector<std::string> corpus = ReadInputs(options.inputs);
  for (const std::string& input : corpus) Run(input);
  std::uint64_t executed = corpus.size();
  if (corpus.empty()) corpus.emplace_back();
  std::minstd_rand random(options.seed);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(options.seconds);
  for (; std::chrono::steady_clock::now() < end; ++executed) {
    const std::string& input = corpus[random() % corpus.size()];
    Run(Changed(input, corpus[random() % corpus.size()], random));
  }
  alarm(0);
  std::cerr << "seed " << options.seed << "\nstat::number_of_executed_units: " << executed << '\n';
  return 0;
}

}  // namespace
}  // namespace strata::fuzz

int main(int argc, char** argv) {
  return strata::fuzz::Main(strata::fuzz::ReadOptions(argc, argv));
}
