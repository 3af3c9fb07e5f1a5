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

std::string field(double value) { return std::isfinite(value) ? shortest(value) : ""; }

std::vector<std::string> fields_of(Track& track, int exit, const std::string& reason,
                                   const std::vector<std::string>& observed, double seconds) {
  const Simulation& system = track.system();
  const Verdict verdict = track.verdict();
  const study::Figures& figures = verdict.figures;
  const bool lost = verdict.trust == Trust::kDiverged;  // then its figures say nothing
  const auto figure = [&](double value) { return lost ? "" : field(value); };
  const bool energy = !lost && system.second_order() && track.energy_is_finite();
  std::vector<std::string> fields{
      std::to_string(exit),
      study::trust_name(verdict.trust),
      in_one_line(reason.empty() ? verdict.reason : reason),
      std::to_string(system.step_count()),
      std::to_string(study::evaluations_of(system)),
      field(system.t()),
      energy ? field(track.energy().kinetic) : "",
      energy ? field(track.energy().potential) : "",
      energy ? field(track.energy().total()) : "",
      energy ? field(track.drift()) : "",
      figure(figures.energy),
      field(figures.dt_share),
      figures.strain.a < 0 ? "" : figure(figures.strain.strain),
      figure(figures.step_error),
      figure(track.has_exact() ? track.deviation().error : figures.shadow.error),
      hash_text(system)};
  const auto values = track.observed();
  for (const std::string& name : observed) {
    fields.emplace_back();
    for (std::size_t i = 0; i < values.size(); ++i)
      if (track.observers()[i].name == name) fields.back() = field(values[i]);
    for (std::size_t i = 0; i < track.judged().size(); ++i)
      if (track.judged()[i].text() == name) fields.back() = field(track.figure(i));
  }
  fields.push_back(brief(seconds, 3));
  return fields;
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

const std::vector<std::string>& case_columns() {
  static const std::vector<std::string> names{
      "exit",  "verdict", "reason", "steps",    "evaluations", "t",          "kinetic", "potential",
      "total", "drift",   "energy", "dt_share", "strain",      "step_error", "error",   "hash"};
  return names;
}

CaseResult measured_case(const CaseRun& run, const std::vector<std::string>& observed,
                         const Environment& environment, Registry& registry) {
  try {
    LoadedScene scene = load(run.scene, environment, registry);
    if (scene.spec.world)
      throw Error(ErrorKind::kUsage, {"several systems", run.scene.scene, "it is a world",
                                      "name the file of one of its scenes"});
    Simulation& system = scene.systems.front();
    Track track(scene.spec.systems.front(), system, steps_of(run.length, system), Track::kNever,
                Track::kNever, &registry);
    shorten(run.length, track);
    std::vector<study::Quantity> figures;
    for (const std::string& text : run.of) figures.emplace_back(scene.spec.systems.front(), text);
    track.judge(figures);
    const auto begin = CaseProcess::Clock::now();
    follow(track, [] { return false; });
    const double seconds = std::chrono::duration<double>(CaseProcess::Clock::now() - begin).count();
    if (run.verify)
      track.verify([] { return false; });
    else
      track.leave_unverified("positions not verified");
    const Verdict verdict = track.verdict();
    int exit = verdict.trust == Trust::kDiverged ? static_cast<int>(ErrorKind::kDiverged) : 0;
    std::string reason;
    if (run.checks && exit == 0) try {
        check(*run.checks, verdict, system.name());
      } catch (const Error& error) {
        exit = static_cast<int>(error.kind());
        reason = error.what();
      }
    CaseResult result{fields_of(track, exit, reason, observed, seconds), scene.spec.inputs};
    for (InputFile& library : registry.inputs()) result.inputs.push_back(std::move(library));
    return result;
  } catch (const Error& error) {
    return {lost_case(static_cast<int>(error.kind()), error.what(), observed.size())};
  } catch (const std::bad_alloc&) {
    return {lost_case(static_cast<int>(ErrorKind::kIo), "out of memory", observed.size())};
  }
}

std::vector<std::string> lost_case(int exit, const std::string& reason, std::size_t observed) {
  std::vector<std::string> fields(case_columns().size() + observed + 1);
  fields[0] = std::to_string(exit);
  fields[2] = in_one_line(reason);
  return fields;
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
