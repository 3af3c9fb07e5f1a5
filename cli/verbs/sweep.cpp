#include "cli/verbs/sweep.h"

#include <poll.h>

#include <algorithm>
#include <cmath>
#include <list>

#include "cli/run/study_progress.h"
#include "cli/verbs/sweep_key.h"
#include "cli/verbs/sweep_run.h"
#include "cli/verbs/sweep_store.h"
#include "core/base/error.h"
#include "core/base/hash.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/report/sweep_cases.h"
#include "core/session/side_by_side.h"

namespace sim::cli {
namespace {

constexpr int kSomeFailed = 9, kTimedOut = 124;
constexpr int kLookEvery = 100;  // ms, for signals and timeouts

bool is_exit(const std::string& field, ErrorKind kind) {
  return field == std::to_string(static_cast<int>(kind));
}

// True if the run of a case came to an end that another try would not change.
bool has_ended(const CaseResult& result) {
  const std::string& exit = result.fields.front();
  return exit == "0" || is_exit(exit, ErrorKind::kDiverged) || is_exit(exit, ErrorKind::kCheck);
}

class Sweep {
 public:
  Sweep(const SweepRequest& request, const Environment& environment, Registry& registry);

  std::string list() const;
  // Runs the unknown cases. False if it was told to end.
  bool run(StudyProgress& progress);
  void collect();  // the results of earlier runs
  void write(Console& console) const;
  std::string notes() const;  // of rows that could not be kept
  std::string summary() const;
  bool some_failed() const { return failed_ > 0 || missing() > 0; }

 private:
  struct Job {
    std::vector<std::size_t> indices;
    CaseProcess process;
  };

  CaseRun case_run(std::size_t index) const;
  std::uint64_t key(std::size_t index) const;
  bool mine(std::size_t index) const {
    return static_cast<std::int64_t>(index) % request_.parts == request_.part;
  }
  std::size_t fields() const { return case_columns().size() + observed_.size() + 1; }
  bool recall(std::size_t index, bool with_failed);
  // The unfinished cases of a process are tried one by one.
  void finish(Job& job, bool late, std::vector<std::size_t>& alone);
  std::size_t cases_at_once(std::size_t waiting) const;
  void keep(std::size_t index, CaseResult result, bool is_new);
  std::size_t missing() const;

  const SweepRequest& request_;
  const Environment& environment_;
  Registry& registry_;
  SweepCases cases_;
  std::vector<std::string> observed_;
  std::optional<SweepStore> store_;
  std::vector<std::vector<std::string>> rows_;  // of each case; empty: not known
  std::size_t failed_ = 0, done_ = 0, kept_ = 0;
  std::string scene_file_;
  std::vector<InputFile> inputs_;  // of the scene with its own values
  bool side_by_side_ = false;
  std::uint64_t program_ = 0;
  FileContents contents_;
  std::string damaged_, changed_;  // the first row that is, the first input that has
};

Sweep::Sweep(const SweepRequest& request, const Environment& environment, Registry& registry)
    : request_(request), environment_(environment), registry_(registry) {
  cases_ =
      request.cases.empty() ? report::product_of(request.over) : report::cases_in(request.cases);
  rows_.resize(cases_.count());
  if (!request.out.empty()) store_.emplace(request.out);
  // With the scene's own values: what it knows of names.
  const LoadedScene scene = load(request.scene, environment, registry);
  report::check_cases(cases_, scene.spec, request.scene.scene);
  FilePlan plan;
  plan_inputs(scene.spec, registry, plan);
  if (!request.cases.empty()) plan.reads("--cases", request.cases);
  if (!request.out.empty()) plan.writes("--out", request.out);
  if (store_) plan.writes("a kept case", store_->names());
  plan.check();
  observed_ = report::observed_columns(scene.spec.systems.front(), request.of);
  scene_file_ = scene.spec.file;
  inputs_ = scene.spec.inputs;
  const std::vector<std::string> of_runs{"integrator", "dt", "tol", "time", "steps"};
  side_by_side_ = !request.timeout && may_step_side_by_side(scene.systems.front()) &&
                  std::ranges::none_of(of_runs, [&](const auto& name) { return cases_.has(name); });
  program_ = program_key(environment);
  for (std::size_t i = 0; i < cases_.count(); ++i) case_run(i);  // for its errors
}

// The request with the values of a case. Throws Error{kUsage} for a text that is no value.
CaseRun Sweep::case_run(std::size_t index) const {
  CaseRun run{request_.scene, request_.length, request_.checks, request_.verify, request_.of};
  SceneRequest& scene = run.scene;
  scene.threads = 1;
  report::CaseValues values = report::values_of(
      cases_, index, {scene.settings, scene.integrator, scene.dt, scene.seed, run.length});
  scene.settings = std::move(values.settings);
  scene.integrator = std::move(values.integrator);
  scene.dt = values.dt;
  scene.seed = values.seed;
  run.length = values.length;
  return run;
}

// Everything that the fields of a case depend on, except for the files that are read for it.
std::uint64_t Sweep::key(std::size_t index) const {
  StateHash key;
  key.add(program_);
  key.add(request_key(case_run(index), scene_file_));
  return key.value();
}

std::string Sweep::list() const {
  std::string text = "case";
  for (const std::string& name : cases_.names) text += "," + csv_field(name);
  text += '\n';
  for (std::size_t i = 0; i < cases_.count(); ++i) {
    if (!mine(i)) continue;
    text += std::to_string(i);
    for (const std::string& value : cases_.rows[i]) text += "," + csv_field(value);
    text += '\n';
  }
  return text;
}

bool Sweep::recall(std::size_t index, bool with_failed) {
  if (!store_) return false;
  StoredCase kept = store_->get(index, key(index));
  if (kept.state == StoredCase::State::kDamaged && damaged_.empty())
    damaged_ = store_->file_of(index).string();
  if (kept.state != StoredCase::State::kWhole || kept.result.fields.size() != fields())
    return false;
  if (const InputFile* const changed = contents_.changed(kept.result.inputs)) {
    if (changed_.empty()) changed_ = changed->name + " (" + changed->path + ")";
    return false;
  }
  if (!with_failed && !has_ended(kept.result)) return false;
  keep(index, std::move(kept.result), false);
  return true;
}

void Sweep::keep(std::size_t index, CaseResult result, bool is_new) {
  if (is_new && store_) store_->put(index, key(index), result);
  const std::string& exit = result.fields.front();
  failed_ += exit != "0" && !is_exit(exit, ErrorKind::kDiverged);
  rows_[index] = std::move(result.fields);
  ++done_;
  kept_ += !is_new;
}

void Sweep::finish(Job& job, bool late, std::vector<std::size_t>& alone) {
  const int exit = job.process.wait();
  std::vector<CaseResult> results;
  if (exit == 0) results = job.process.results();
  if (results.size() != job.indices.size() && job.indices.size() > 1) {
    alone.insert(alone.end(), job.indices.rbegin(), job.indices.rend());
    return;
  }
  results.resize(job.indices.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    CaseResult& result = results[i];
    if (late)
      result.fields = lost_case(kTimedOut, "not ready after " + brief(*request_.timeout) + " s",
                                observed_.size());
    else if (result.fields.size() != fields())
      result.fields = lost_case(
          exit == 0 ? 1 : exit,
          exit > 128 ? "ended by signal " + std::to_string(exit - 128) : "it ended without a word",
          observed_.size());
    if (result.inputs.empty()) result.inputs = inputs_;
    keep(job.indices[i], std::move(result), true);
  }
}

// Fills the lanes, but with no fewer processes than threads.
std::size_t Sweep::cases_at_once(std::size_t waiting) const {
  constexpr std::size_t kMost = 64;
  const auto threads = static_cast<std::size_t>(request_.scene.threads.most);
  return side_by_side_ ? std::clamp<std::size_t>(waiting / threads, 1, kMost) : 1;
}

std::string Sweep::notes() const {
  std::string text;
  if (!damaged_.empty())
    text += "sim: note: " + damaged_ + " is damaged, or of another version: not used\n";
  if (!changed_.empty())
    text += "sim: note: " + changed_ + " has changed: rows of before are not used\n";
  return text;
}

bool Sweep::run(StudyProgress& progress) {
  const study::Watch watch = progress.watch();
  std::vector<std::size_t> waiting, alone;
  std::size_t total = 0;
  for (std::size_t i = 0; i < cases_.count(); ++i) {
    total += mine(i);
    if (mine(i) && !recall(i, request_.keep_failed)) waiting.push_back(i);
  }
  std::ranges::reverse(waiting);
  std::list<Job> jobs;
  const Stopwatch begun;
  const auto time_left = [&]() -> std::string {
    const std::size_t run = done_ - kept_;
    if (run == 0) return "";
    const double each = begun.seconds() / static_cast<double>(run);
    return ", " + brief(std::ceil(each * static_cast<double>(total - done_)), 3) + " s left";
  };
  const auto start = [&](std::vector<std::size_t>& from, std::size_t count) {
    std::vector<std::size_t> indices(from.rbegin(),
                                     from.rbegin() + static_cast<std::ptrdiff_t>(count));
    from.resize(from.size() - count);
    CaseProcess process([&] {
      std::vector<CaseRun> runs;
      for (const std::size_t index : indices) runs.push_back(case_run(index));
      return measured_cases(runs, observed_, environment_, registry_);
    });
    jobs.push_back({std::move(indices), std::move(process)});
  };
  while (!waiting.empty() || !alone.empty() || !jobs.empty()) {
    while ((!waiting.empty() || !alone.empty()) &&
           jobs.size() < static_cast<std::size_t>(request_.scene.threads.most))
      if (!alone.empty())
        start(alone, 1);
      else
        start(waiting, cases_at_once(waiting.size()));
    std::vector<pollfd> pipes;
    for (const Job& job : jobs) pipes.push_back({job.process.pipe(), POLLIN, 0});
    ::poll(pipes.data(), pipes.size(), kLookEvery);
    if (!watch(std::to_string(done_) + " of " + std::to_string(total) + " cases" + time_left(),
               static_cast<double>(done_) / static_cast<double>(total)))
      return false;
    std::size_t at = 0;
    for (auto job = jobs.begin(); job != jobs.end(); ++at) {
      const bool late = request_.timeout && job->process.seconds() > *request_.timeout;
      if (late) job->process.end();
      if (!late && (pipes[at].revents == 0 || job->process.take())) {
        ++job;
        continue;
      }
      finish(*job, late, alone);
      job = jobs.erase(job);
    }
  }
  return true;
}

void Sweep::collect() {
  if (!store_)
    throw Error(ErrorKind::kUsage, {"nothing to collect", "--collect",
                                    "cases are kept beside the table", "add --out runs.csv"});
  for (std::size_t i = 0; i < cases_.count(); ++i) recall(i, true);
}

std::size_t Sweep::missing() const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i) count += rows_[i].empty() && mine(i);
  return count;
}

void Sweep::write(Console& console) const {
  Output table(request_.out.empty() ? Target{} : parse_target("--out", request_.out), console.out);
  std::string& text = table.buffer();
  text += "case";
  for (const auto* names : {&cases_.names, &case_columns(), &observed_})
    for (const std::string& name : *names) text += "," + csv_field(name);
  text += ",seconds\n";
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (rows_[i].empty()) continue;
    text += std::to_string(i);
    for (const auto* fields : {&cases_.rows[i], &rows_[i]})
      for (const std::string& each : *fields) text += "," + csv_field(each);
    text += '\n';
  }
  table.commit();
}

std::string Sweep::summary() const {
  const std::size_t left = missing();
  std::string text = std::to_string(done_) +
                     (left > 0 ? " of " + std::to_string(done_ + left) : std::string()) + " cases";
  if (kept_ > 0) text += ", " + std::to_string(kept_) + " of them kept from before";
  if (left > 0) text += ", " + std::to_string(left) + " missing";
  if (failed_ > 0) text += ", " + std::to_string(failed_) + " failed";
  return text;
}

}  // namespace

int sweep(const SweepRequest& request, const Environment& environment, Registry& registry,
          Console& console) {
  StudyProgress progress(request.progress, console);
  Sweep sweep(request, environment, registry);
  if (request.list) {
    put(console.out, sweep.list());
    flush_or_throw(console.out, "standard output");
    return 0;
  }
  const bool whole = request.collect || sweep.run(progress);
  if (request.collect) sweep.collect();
  progress.clear();
  if (whole && (request.parts == 1 || request.collect)) sweep.write(console);
  console.err << sweep.notes() << "sim: " << sweep.summary()
              << (whole || request.out.empty() ? "" : "; the same command goes on from here")
              << '\n'
              << std::flush;
  if (const int code = progress.exit_code()) return code;
  return sweep.some_failed() ? kSomeFailed : 0;
}

}  // namespace sim::cli
