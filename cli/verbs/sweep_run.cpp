#include "cli/verbs/sweep_run.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <memory>

#include "cli/run/environment.h"
#include "cli/run/judged.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/report/summary.h"
#include "core/session/side_by_side.h"

namespace sim::cli {
namespace {

constexpr char kBetweenFields = '\x1f', kBetweenRecords = '\x1e', kBetweenCases = '\x1d';

std::vector<std::string> split(const std::string& text, char between) {
  std::vector<std::string> parts(1);
  for (const char c : text)
    if (c == between)
      parts.emplace_back();
    else
      parts.back() += c;
  return parts;
}

// A record of the fields, then one of each file.
std::string said(const CaseResult& result) {
  const std::string between(1, kBetweenFields);
  std::string text = join(result.fields, between);
  for (const InputFile& file : result.inputs)
    text += kBetweenRecords + file.name + between + report::in_one_line(file.path) + between +
            std::to_string(file.hash);
  return text;
}

// The scene of a case, and its run.
struct Case {
  Case(const CaseRun& run, const std::vector<std::string>& observed, const Environment& environment,
       Registry& registry)
      : scene(load(run.scene, environment, registry)),
        judged(scene, registry, task(run, observed)) {}

  static report::CaseTask task(const CaseRun& run, const std::vector<std::string>& observed) {
    report::CaseTask task{
        .length = run.length, .of = run.of, .observed = observed, .verify = run.verify, .stop = [] {
          return false;
        }};
    if (run.checks)
      task.check = [checks = *run.checks](const Verdict& verdict, const std::string& system) {
        check(checks, verdict, system);
      };
    return task;
  }
  CaseResult result(double seconds, Registry& registry) {
    CaseResult result{judged.row(seconds), scene.spec.inputs};
    for (InputFile& library : registry.inputs()) result.inputs.push_back(std::move(library));
    return result;
  }

  LoadedScene scene;
  report::JudgedCase judged;
};

}  // namespace

std::vector<CaseResult> measured_cases(std::span<const CaseRun> runs,
                                       const std::vector<std::string>& observed,
                                       const Environment& environment, Registry& registry) {
  std::vector<CaseResult> results(runs.size());
  std::vector<std::unique_ptr<Case>> cases(runs.size());
  // An error ends a case alone.
  const auto for_each_case = [&](const std::function<void(std::size_t)>& work) {
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (!results[i].fields.empty()) continue;
      try {
        work(i);
      } catch (const Error& error) {
        results[i] = {lost_case(static_cast<int>(error.kind()), error.what(), observed.size())};
      } catch (const std::bad_alloc&) {
        results[i] = {
            lost_case(static_cast<int>(ErrorKind::kIo), "out of memory", observed.size())};
      }
    }
  };
  for_each_case([&](std::size_t i) {
    cases[i] = std::make_unique<Case>(runs[i], observed, environment, registry);
  });
  std::vector<Simulation*> systems;
  for (const auto& each : cases)
    if (each) systems.push_back(&each->scene.systems.front());
  step_side_by_side(systems);
  const Stopwatch watch;
  for_each_case([&](std::size_t i) { cases[i]->judged.run(); });
  const double mean =
      watch.seconds() / static_cast<double>(std::max<std::size_t>(1, systems.size()));
  for_each_case([&](std::size_t i) { results[i] = cases[i]->result(mean, registry); });
  return results;
}

CaseProcess::CaseProcess(const std::function<std::vector<CaseResult>()>& work) {
  int ends[2];
  const pid_t parent = ::getpid();
  if (::pipe2(ends, O_CLOEXEC) == 0) child_ = ::fork();
  if (child_ < 0)
    throw Error(ErrorKind::kIo, {"cannot start a case", "", std::strerror(errno), "a smaller -j"});
  if (child_ == 0) {
    // The kernel ends it with its parent, which may have ended before it was told so.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
    ::close(ends[0]);
    int exit = 1;
    try {
      std::string text;
      for (const CaseResult& result : work()) {
        if (!text.empty()) text += kBetweenCases;
        text += said(result);
      }
      for (std::size_t sent = 0; sent < text.size();) {
        const ssize_t more = ::write(ends[1], text.data() + sent, text.size() - sent);
        if (more <= 0) ::_exit(1);
        sent += static_cast<std::size_t>(more);
      }
      exit = 0;
    } catch (...) {  // it is a row without fields
    }
    ::_exit(exit);
  }
  ::close(ends[1]);
  pipe_ = ends[0];
}

CaseProcess::CaseProcess(CaseProcess&& other) noexcept
    : child_(std::exchange(other.child_, -1)),
      pipe_(std::exchange(other.pipe_, -1)),
      watch_(other.watch_),
      said_(std::move(other.said_)) {}

CaseProcess::~CaseProcess() {
  end();
  if (child_ > 0) wait();
  if (pipe_ >= 0) ::close(pipe_);
}

bool CaseProcess::take() {
  char bytes[4096];
  const ssize_t got = ::read(pipe_, bytes, sizeof bytes);
  if (got > 0) said_.append(bytes, static_cast<std::size_t>(got));
  return got > 0 || (got < 0 && errno == EINTR);
}

void CaseProcess::end() {
  if (child_ > 0) ::kill(child_, SIGKILL);
}

int CaseProcess::wait() {
  int status = 0;
  while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {}
  child_ = -1;
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

std::vector<CaseResult> CaseProcess::results() const {
  std::vector<CaseResult> results;
  for (const std::string& text : split(said_, kBetweenCases)) {
    std::vector<std::vector<std::string>> records;
    for (const std::string& record : split(text, kBetweenRecords))
      records.push_back(split(record, kBetweenFields));
    CaseResult result{records.front()};
    for (std::size_t i = 1; i < records.size(); ++i) {
      if (records[i].size() != 3) return {};
      result.inputs.push_back({records[i][0], records[i][1], std::stoull(records[i][2])});
    }
    results.push_back(std::move(result));
  }
  return results;
}

}  // namespace sim::cli
