// Takes mesh files through read, quality, smooth, write and compare, each in a process of its own
// with limits. Reads "ID<TAB>PATH" lines from the standard input; prints one object of JSON a step,
// and {"id": …, "step": "end", …} when the process of a file has ended.
//   corpus_driver FOLDER [PROCESSES [CPU_SECONDS [MEMORY_MB]]]
// A fork of one process costs no start-up of the libraries.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>

#include "file_job.hpp"

namespace {

using meshsmooth::corpus::JsonLine;
using Clock = std::chrono::steady_clock;

/// Bounds of the process of one file. Wall time is only for what waits: others may use the
/// processors. Not every sandbox obeys RLIMIT_CPU: the parent watches the CPU time too.
struct Limits {
  int processes = 1;
  rlim_t cpu_seconds = 90;
  rlim_t memory_bytes = rlim_t{4096} << 20;
  std::chrono::seconds wall = std::chrono::minutes(30);
};

struct Running {
  std::string id;
  Clock::time_point deadline;
};

void set_limit(int resource, rlim_t value) {
  const rlimit limit{value, value};
  setrlimit(resource, &limit);
}

/// One `write`, so that the lines of several processes do not mix.
void print(const std::string& id, const JsonLine& line) {
  JsonLine whole;
  whole.add("id", id);
  const std::string text = whole.text();
  const std::string out = text.substr(0, text.size() - 1) + ", " + line.text().substr(1) + "\n";
  if (::write(STDOUT_FILENO, out.data(), out.size()) < 0) std::_Exit(1);
}

[[noreturn]] void run_child(const std::string& id, const std::string& path,
                            const std::filesystem::path& folder, const Limits& limits) {
  set_limit(RLIMIT_CPU, limits.cpu_seconds);
  set_limit(RLIMIT_AS, limits.memory_bytes);
  set_limit(RLIMIT_CORE, 0);
  // What libraries print is not of interest here.
  const int nowhere = ::open("/dev/null", O_WRONLY);
  ::dup2(nowhere, STDERR_FILENO);
  meshsmooth::corpus::run_file(path, folder / id, [&](const JsonLine& line) { print(id, line); });
  std::_Exit(0);
}

void report_end(const std::string& id, int status, const rusage& used) {
  JsonLine line;
  line.add("step", "end");
  line.add("signal", static_cast<long long>(WIFSIGNALED(status) ? WTERMSIG(status) : 0));
  line.add("exit", static_cast<long long>(WIFEXITED(status) ? WEXITSTATUS(status) : 0));
  const auto seconds = [](timeval t) {
    return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
  };
  line.add("cpu_seconds", seconds(used.ru_utime) + seconds(used.ru_stime));
  line.add("peak_mb", static_cast<long long>(used.ru_maxrss / 1024));
  print(id, line);
}

/// Of a process that runs, all its threads; 0 where it is not known.
rlim_t cpu_seconds_of(pid_t pid) {
  clockid_t clock{};
  timespec used{};
  if (::clock_getcpuclockid(pid, &clock) != 0 || ::clock_gettime(clock, &used) != 0) return 0;
  return static_cast<rlim_t>(used.tv_sec);
}

/// Waits for one process to end; kills those that are over their time.
void wait_for_one(std::map<pid_t, Running>& running, const Limits& limits) {
  while (true) {
    int status = 0;
    rusage used{};
    const pid_t pid = ::wait4(-1, &status, WNOHANG, &used);
    if (const auto ended = running.find(pid); pid > 0 && ended != running.end()) {
      report_end(ended->second.id, status, used);
      running.erase(ended);
      return;
    }
    for (const auto& [child, job] : running) {
      if (Clock::now() > job.deadline || cpu_seconds_of(child) > limits.cpu_seconds) {
        ::kill(child, SIGKILL);
      }
    }
    ::usleep(2000);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: corpus_driver FOLDER [PROCESSES [CPU_SECONDS [MEMORY_MB]]] < LIST\n";
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  Limits limits;
  if (argc > 2) limits.processes = std::atoi(argv[2]);
  if (argc > 3) limits.cpu_seconds = static_cast<rlim_t>(std::atoi(argv[3]));
  if (argc > 4) limits.memory_bytes = static_cast<rlim_t>(std::atoi(argv[4])) << 20;
  std::map<pid_t, Running> running;
  for (std::string line; std::getline(std::cin, line);) {
    const std::size_t tab = line.find('\t');
    if (tab == std::string::npos) continue;
    const std::string id = line.substr(0, tab);
    const pid_t pid = ::fork();
    if (pid < 0) {
      std::cerr << "corpus_driver: cannot fork\n";
      return 1;
    }
    if (pid == 0) run_child(id, line.substr(tab + 1), folder, limits);
    running.emplace(pid, Running{id, Clock::now() + limits.wall});
    if (static_cast<int>(running.size()) >= limits.processes) wait_for_one(running, limits);
  }
  while (!running.empty()) wait_for_one(running, limits);
  return 0;
}
