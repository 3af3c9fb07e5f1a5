#include "cli/verbs/sweep_run.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>

#include "cli/run/environment.h"
#include "cli/run/judged.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/report/summary.h"

namespace sim::cli {
namespace {

constexpr char kBetweenFields = '\x1f', kBetweenRecords = '\x1e';

std::string in_one_line(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  return text;
}

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
    text += kBetweenRecords + file.name + between + in_one_line(file.path) + between +
            std::to_string(file.hash);
  return text;
}

}  // namespace

CaseResult measured_case(const CaseRun& run, const std::vector<std::string>& observed,
                         const Environment& environment, Registry& registry) {
  try {
    LoadedScene scene = load(run.scene, environment, registry);
    report::CaseTask task{
        .length = run.length, .of = run.of, .observed = observed, .verify = run.verify, .stop = [] {
          return false;
        }};
    if (run.checks)
      task.check = [&](const Verdict& verdict, const std::string& system) {
        check(*run.checks, verdict, system);
      };
    CaseResult result{report::run_case(scene, registry, task), scene.spec.inputs};
    for (InputFile& library : registry.inputs()) result.inputs.push_back(std::move(library));
    return result;
  } catch (const Error& error) {
    return {lost_case(static_cast<int>(error.kind()), error.what(), observed.size())};
  } catch (const std::bad_alloc&) {
    return {lost_case(static_cast<int>(ErrorKind::kIo), "out of memory", observed.size())};
  }
}

CaseProcess::CaseProcess(const std::function<CaseResult()>& work) : begin_(Clock::now()) {
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
      const std::string text = said(work());
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
      begin_(other.begin_),
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

double CaseProcess::seconds() const {
  return std::chrono::duration<double>(Clock::now() - begin_).count();
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

CaseResult CaseProcess::result() const {
  std::vector<std::vector<std::string>> records;
  for (const std::string& record : split(said_, kBetweenRecords))
    records.push_back(split(record, kBetweenFields));
  CaseResult result{records.front()};
  for (std::size_t i = 1; i < records.size(); ++i) {
    if (records[i].size() != 3) return {};
    result.inputs.push_back({records[i][0], records[i][1], std::stoull(records[i][2])});
  }
  return result;
}

}  // namespace sim::cli
