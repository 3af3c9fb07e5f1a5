// The scene behind a prompt: its systems, their history, and its branches.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/prompt/scene_branch.h"
#include "cli/prompt/scene_changes.h"
#include "cli/prompt/work_ledger.h"
#include "cli/run/judged.h"
#include "cli/run/report.h"
#include "cli/run/scene.h"
#include "core/session/recording.h"

namespace sim::cli {

class LiveScene {
 public:
  using Condition = std::function<bool()>;
  // budget: of all snapshots together, in bytes. Throws the errors of load().
  LiveScene(const SceneRequest& request, const Environment& environment, Registry& registry,
            std::size_t budget, std::ostream& err, bool progress);

  const SceneRequest& request() const { return origin_->request; }
  const LoadedScene& scene() const { return origin_->scene; }
  LoadedScene& loaded() { return origin_->scene; }
  std::size_t current() const { return current_; }  // the system that particles are meant of
  Simulation& system() { return origin_->scene.systems[current_]; }
  const SystemSpec& spec() const { return scene().spec.systems[current_]; }
  void choose(std::size_t system) { current_ = system; }
  double start_energy(std::size_t system) const;  // J, from where its drift counts
  double work(std::size_t system) const { return ledger_.work(system, scene().systems[system]); }
  double drift(std::size_t system, const Energy& now) const;  // J, as work; NaN: not known
  Track track(std::size_t system);                            // with that start

  // Each system takes so many steps, or runs until then: the one furthest behind in time takes the
  // next step. Throws Interrupted and Error{kDiverged}; steps stay whole. `until` ends it; tested
  // first.
  using Outcome = std::optional<Verdict>;  // none for a repetition with changes by the user
  Outcome step(std::int64_t steps);  // judged when that is asked for, with others that came before
  Outcome run(double seconds);       // the last step is shorter if necessary, beyond those known
  Outcome run_until(const Condition& until);  // Error{kCheck} after 100 durations of the scene
  const std::optional<Judged>& judged();      // none before the first run
  std::vector<Look> looks;
  void reset();
  void back(std::int64_t steps);   // Error{kUsage} for a step before the first snapshot
  void go_to(double t);            // s; the same
  bool undo();                     // the last change of the present system, at the same time
  void part();                     // the next change counts by itself
  void act(const Action& action);  // on the present system
  void edit(const std::function<void(Simulation&)>& change);  // the same, if it is no action
  void record(RecordingWriter* writer) { writer_ = writer; }  // then no branch, no reload
  // Hands the timelines to another owner, who returns them.
  void lend(const std::function<void(std::vector<Timeline>&, RecordingWriter*)>& play);

  // Choices that outlast a reload.
  void set_integrator(const MethodChoice& choice);
  void set_dt(double h);
  // Reads the file again, with a parameter changed if there is one, and runs it to the same time:
  // returns the differences. The session is unchanged if it throws; other branches keep their
  // scene.
  std::vector<Change> reload(const std::optional<std::pair<std::string, std::string>>& setting);
  void open(const std::string& scene);  // another one, at its start

  using Branch = SceneBranch;
  const std::string& branch() const { return branch_; }
  std::map<std::string, Branch> branches();  // the present one too, as it is now
  void add_branch(const std::string& name);  // starts here, and here we stay
  void switch_to(const std::string& name);
  // The first difference up to the end of the shorter history; empty if no bit differs. Throws
  // Error{kUsage} for branches whose scenes have different numbers.
  std::optional<FirstDifference> diff(const std::string& a, const std::string& b);
  void save(const std::string& file);
  void resume(const std::string& file);
  void end_record();

 private:
  Outcome advance(LoadedScene& scene, std::vector<Timeline>& timelines,
                  const std::vector<std::int64_t>& targets, const Condition* until = nullptr,
                  std::optional<double> seconds = {},  // ... to end after exactly so many
                  bool judge = true);
  std::vector<std::int64_t> present_steps() const;
  void judge_steps();
  std::vector<std::int64_t> targets_after(double seconds) const;
  void travel(const std::vector<std::int64_t>& steps);
  void check_idle();           // throws Error{kUsage} inside a run; judges the last steps
  void check_one_way() const;  // ... or in a recording
  std::string recorded_name(std::size_t system) const;
  void share_budget();
  void take_looks(std::size_t system);
  void adopt(std::shared_ptr<SceneOrigin> origin);  // the present branch, at its start
  void apply_choices(LoadedScene& scene) const;
  Branch present();
  Branch branch_named(const std::string& name);

  // Steps taken by separate commands, one after the other, and not judged yet.
  struct Stepped {
    std::vector<std::int64_t> from, to;
  };

  const Environment& environment_;
  Registry& registry_;
  std::size_t budget_;
  std::ostream& err_;
  bool progress_, running_ = false;
  std::shared_ptr<SceneOrigin> origin_;
  std::optional<Judged> judged_;
  std::optional<Stepped> stepped_;
  WorkLedger ledger_;
  std::vector<Timeline> timelines_;
  std::size_t current_ = 0;
  std::string branch_ = "main";
  std::map<std::string, Branch> branches_;  // the others
  RecordingWriter* writer_ = nullptr;
};

}  // namespace sim::cli
