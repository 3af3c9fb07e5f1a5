#include "core/c/sweep.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "core/base/thread_start.h"
#include "core/output/format.h"
#include "core/report/case_run.h"

namespace sim::c {
namespace {

class Sweep {
 public:
  Sweep(const std::string& scene, const char* text, const Asked& asked, AskedWords& words,
        Watcher& watcher);

  std::string run();

 private:
  void work() noexcept;
  std::vector<std::string> row(std::size_t index, Registry& registry) const;
  std::string json() const;

  const std::string scene_;
  const char* const text_;
  const Asked asked_;
  Watcher& watcher_;
  report::SweepCases cases_;
  report::CaseTask task_;
  std::vector<std::vector<std::string>> rows_;

  std::mutex mutex_;
  std::condition_variable progress_;
  std::size_t next_ = 0, done_ = 0;  // cases that were begun, and that are over
  std::exception_ptr failure_;       // of a worker, not of a case
};

Sweep::Sweep(const std::string& scene, const char* text, const Asked& asked, AskedWords& words,
             Watcher& watcher)
    : scene_(scene), text_(text), asked_(asked), watcher_(watcher) {
  const std::vector<std::string> over = words.all("over");
  const std::string file = words.text("cases");
  if (over.empty() == file.empty())
    refuse("what to sweep over?", "over and cases", "it is one of the two",
           "as in over=dt=0.001:0.01:log5");
  cases_ = file.empty() ? report::product_of(over) : report::cases_in(file);
  task_.of = words.all("of");
  task_.length.time = words.number("time");
  task_.verify = words.flag("verify", true);
  words.finish("sweep");
  task_.stop = [this] { return watcher_.told(); };
  rows_.resize(cases_.count());

  // With the scene's own values: what it knows of names.
  const auto registry = registry_of(asked_, environment_of(asked_));
  const StudiedScene own = load(scene_, text_, asked_, asked_.variant, *registry);
  report::check_cases(cases_, own.spec, scene_);
  task_.observed = report::observed_columns(own.spec.systems.front(), task_.of);
  for (std::size_t i = 0; i < cases_.count(); ++i) report::values_of(cases_, i, {});
}

std::vector<std::string> Sweep::row(std::size_t index, Registry& registry) const {
  try {
    Asked asked = asked_;
    asked.threads = Threads(1);
    SceneVariant& variant = asked.variant;
    const report::CaseValues values = report::values_of(
        cases_, index,
        {variant.settings, variant.integrator, variant.dt, asked.seed, task_.length});
    variant.settings = values.settings;
    variant.integrator = values.integrator;
    variant.dt = values.dt;
    asked.seed = values.seed;
    report::CaseTask task = task_;
    task.length = values.length;
    StudiedScene scene = load(scene_, text_, asked, variant, registry, task_.stop);
    return report::run_case(scene, registry, task);
  } catch (const Error& error) {
    return report::lost_case(static_cast<int>(error.kind()), error.what(), task_.observed.size());
  } catch (const std::bad_alloc&) {
    return report::lost_case(SIM_IO, "out of memory", task_.observed.size());
  }
}

// Takes case after case. A registry opens libraries: each thread has its own.
void Sweep::work() noexcept {
  try {
    const auto registry = registry_of(asked_, environment_of(asked_));
    std::unique_lock lock(mutex_);
    while (next_ < rows_.size() && !watcher_.told() && !failure_) {
      const std::size_t index = next_++;
      lock.unlock();
      std::vector<std::string> fields = row(index, *registry);
      lock.lock();
      rows_[index] = std::move(fields);
      ++done_;
      progress_.notify_one();
    }
  } catch (...) {
    const std::scoped_lock lock(mutex_);
    failure_ = std::current_exception();
    progress_.notify_one();
  }
}

std::string Sweep::run() {
  constexpr std::chrono::milliseconds kLookEvery{50};
  const auto most = static_cast<std::size_t>(asked_.threads.most);
  std::vector<std::jthread> workers(std::clamp<std::size_t>(most, 1, rows_.size()));
  bool started = false;
  for (std::jthread& worker : workers)
    if (start_thread(worker, [this] { work(); })) started = true;
  if (!started) work();
  {
    std::unique_lock lock(mutex_);
    while (done_ < rows_.size() && !failure_) {
      const std::string what =
          std::to_string(done_) + " of " + std::to_string(rows_.size()) + " cases";
      const double done = static_cast<double>(done_) / static_cast<double>(rows_.size());
      lock.unlock();
      const bool stopped = watcher_.stopped(what.c_str(), done);
      lock.lock();
      if (stopped) break;
      progress_.wait_for(lock, kLookEvery);
    }
  }
  workers.clear();  // joins
  if (failure_) std::rethrow_exception(failure_);
  return watcher_.told() ? "" : json();
}

std::string Sweep::json() const {
  const auto texts = [](const std::vector<std::string>& names) {
    std::vector<std::string> list;
    for (const std::string& name : names) list.push_back(json_string(name));
    return json_array(list);
  };
  std::vector<std::string> rows;
  for (std::size_t i = 0; i < rows_.size(); ++i)
    rows.push_back(report::case_json(cases_, i, task_.observed, rows_[i]));
  return JsonObject()
      .text("scene", scene_)
      .json("names", texts(cases_.names))
      .json("observed", texts(task_.observed))
      .json("rows", json_array(rows))
      .str();
}

}  // namespace

std::string sweep(const std::string& scene, const char* text, const Asked& asked, AskedWords& words,
                  Watcher& watcher) {
  return Sweep(scene, text, asked, words, watcher).run();
}

}  // namespace sim::c
