#include "cli/run/run.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "cli/run/checkpoint_file.h"
#include "cli/run/error_choice.h"
#include "cli/run/judged.h"
#include "cli/run/postmortem.h"
#include "cli/run/report.h"
#include "cli/run/run_files.h"
#include "cli/run/run_outputs.h"
#include "cli/run/study_progress.h"
#include "cli/terminal/signals.h"
#include "cli/terminal/terminal_view.h"
#include "cli/verbs/export_scene.h"
#include "cli/verbs/rest.h"
#include "core/base/duration_text.h"
#include "core/base/error.h"
#include "core/base/stopwatch.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/report/goal_report.h"
#include "core/report/replays.h"
#include "core/report/summary.h"

namespace sim::cli {
namespace {

// The figures that --of asks of a system; quantities over time are in the report anyway.
std::vector<study::Quantity> figures_of(const SystemSpec& spec,
                                        const std::vector<std::string>& asked) {
  std::vector<study::Quantity> figures;
  for (const std::string& text : asked)
    if (study::Quantity each(spec, text); each.is_figure()) figures.push_back(std::move(each));
  return figures;
}

class Run {
 public:
  // The reference of each system's energy drift; empty = the present state.
  Run(const RunRequest& request, LoadedScene& scene, std::span<const Account> accounts,
      std::optional<report::Replays> replays, GoalChoices choices, Registry& registry,
      Console& console);

  // Returns the exit code; failures during the run are reported.
  int go();

 private:
  static constexpr double kLong = 10;  // s; a run that takes more says so

  int take_steps(const Interrupts& interrupts);
  void take_last();
  bool step(Track& track);
  engine::MoreMoments recorder_moments(std::size_t system);
  void measure(Track& track, bool last = false);
  std::size_t index_of(const Track& track) const {
    return static_cast<std::size_t>(&track - tracks_.data());
  }
  void begin_long_run(double seconds);
  void mention_long_step();
  void verify();
  int conclude(int caught);
  void explain();
  void print_verdicts();

  const RunRequest& request_;
  LoadedScene& scene_;
  Registry& registry_;
  Console& console_;
  std::vector<Track> tracks_;
  std::optional<report::Replays> replays_;
  std::optional<engine::StepSource> source_;
  GoalChoices choices_;  // of --error, one a system, or none
  Report report_;
  Progress progress_;
  RunOutputs outputs_;
  Stopwatch watch_;
  double seconds_ = 0;
  bool long_told_ = false;                     // that it takes long
  std::string explanation_;                    // of a divergence, for people
  std::vector<std::string> explanation_json_;  // ... for machines, one a system
};

std::ostream* report_stream(const RunRequest& request, Console& console) {
  if (request.quiet) return nullptr;
  return request.json ? &console.err : &words(request, console);
}

bool shows_progress(const RunRequest& request, const Console& console) {
  if (request.quiet || request.out.show || request.progress == ShowProgress::kOff) return false;
  return request.progress == ShowProgress::kOn || console.err_is_terminal;
}

Run::Run(const RunRequest& request, LoadedScene& scene, std::span<const Account> accounts,
         std::optional<report::Replays> replays, GoalChoices choices, Registry& registry,
         Console& console)
    : request_(request),
      scene_(scene),
      registry_(registry),
      console_(console),
      replays_(std::move(replays)),
      choices_(std::move(choices)),
      report_(report_stream(request, console), scene),
      progress_(console.err, shows_progress(request, console)),
      outputs_(request, scene, registry, console, progress_) {
  const bool tables = !tables_of(request).empty();
  const std::int64_t frame_stride = request.every.value_or(1);
  const RunLength length{request.time, request.steps};
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    const std::int64_t steps = replays_ ? replays_->steps(i) : steps_of(length, scene.systems[i]);
    const std::int64_t tenth = study::row_stride(steps, scene.spec.world);
    tracks_.emplace_back(scene.spec.systems[i], scene.systems[i], steps,
                         tables ? frame_stride : Track::kNever,
                         request.every && !tables ? frame_stride : tenth, &registry);
    if (scene.systems[i].step_count() > steps)
      throw Error(ErrorKind::kUsage,
                  {"nothing to run", "--resume",
                   "the checkpoint is at t = " + brief(scene.systems[i].t()) + " s already",
                   "give a later --time, which counts from the start of the first run"});
    if (!replays_) shorten(length, tracks_.back());
    if (study::RunDeviation known = parting_of(choices_[i], request); known.verified())
      tracks_.back().verified_by(std::move(known), choices_[i]->allowed);
    tracks_.back().judge(figures_of(scene.spec.systems[i], request.of));
    if (!accounts.empty()) {
      tracks_.back().continue_from(accounts[i].start_energy, accounts[i].work);
      tracks_.back().doubt_start(accounts[i].doubt);
    }
  }
  source_.emplace(scene.spec, tracks_, replays_ ? &*replays_ : nullptr);
  if (!request.engine) return;
  const auto say = [this](const std::string& note) {
    if (!request_.quiet) console_.err << "sim: note: " << note << '\n' << std::flush;
  };
  source_->use(*request.engine, registry, SessionSignals::any, say,
               [this](std::size_t i) { return recorder_moments(i); });
}

void Run::measure(Track& track, bool last) {
  track.sample();
  outputs_.take(index_of(track), track, last);
  if (track.take_row(last) && (!track.system().second_order() || track.energy_is_finite())) {
    progress_.clear();
    if (!request_.out.show) report_.row(track);
    outputs_.flush_words();
  }
}

// Advances to the next state due on the track, or less far. Several systems go step by step. A
// right-hand side in Lua may fail in a step: the error gives the time, and the system stays where
// it was.
bool Run::step(Track& track) {
  Simulation& system = track.system();
  source_->perform(track);
  if (source_->has_engine()) return source_->advance(track, 1) > 0;
  const bool calls_scene = scene_.spec.systems[index_of(track)].one_thread;
  std::optional<Snapshot> before;
  if (calls_scene && request_.snap) before = system.snapshot();
  try {
    std::int64_t most = tracks_.size() > 1 ? 1 : track.due();
    if (outputs_.recorder()) most = std::min(most, outputs_.recorder()->due(0, system));
    return source_->advance(track, most) > 0;
  } catch (const Error& error) {
    if (before) system.restore(*before);
    if (SessionSignals::any()) return false;  // Lua was stopped
    throw in_step(error, system);
  }
}

// The moments of which files want a frame of a system.
engine::MoreMoments Run::recorder_moments(std::size_t system) {
  const Recorder* const recorder = outputs_.recorder();
  if (!recorder) return {};
  return [this, recorder, system](std::int64_t last, const auto& tell) {
    recorder->moments(system, tracks_[system].system(), last, tell);
  };
}

// Runs until all tracks are at their ends, or a signal came, which is returned, or no output is
// left.
int Run::take_steps(const Interrupts& interrupts) {
  if (std::ostream* out = report_stream(request_, console_))
    for (const auto& choice : choices_) put(*out, error_choice_text(choice, request_));
  report_.header(tracks_, source_->title());
  for (Track& track : tracks_) {
    track.system().stop_when([this] {
      mention_long_step();
      return SessionSignals::any();
    });
    measure(track);
  }
  outputs_.look(tracks_);

  watch_ = {};
  bool begun = false;
  source_->start();
  Track* track = furthest_behind(tracks_);
  for (; track && !interrupts.caught() && !outputs_.deserted(); track = furthest_behind(tracks_)) {
    if (!step(*track)) {
      if (interrupts.caught() || track->system().divergence().status == StepStatus::kStopped) break;
      if (!track->stuck()) track->mark_diverged();  // the others go on
      continue;
    }
    measure(*track);
    outputs_.look(tracks_);
    progress_.update(tracks_);
    if (!begun && watch_.seconds() > Track::kQuick) {
      begun = true;
      begin_long_run(watch_.seconds());
    }
  }
  seconds_ = watch_.seconds();
  progress_.clear();

  // A run that stopped early ends with the state it stopped in.
  const int caught = track ? interrupts.caught() : 0;
  source_->finish();
  for (Track& each : tracks_) {
    if (each.finished()) continue;
    measure(each, true);
    if (caught && !each.stuck()) each.mark_interrupted();
  }
  return caught;
}

// After the first second of a run: its verification begins beside it, and long parts are announced.
void Run::begin_long_run(double seconds) {
  const bool beside =
      study::verify_beside(request_.verify, tracks_, request_.scene.threads, SessionSignals::any);
  const double done = study::done_share(tracks_);
  const double whole = done > 0 ? seconds / done : HUGE_VAL;
  if (whole * (beside ? 2 : 1) < kLong || request_.quiet) return;
  long_told_ = true;
  progress_.clear();
  console_.err << "sim: note: the run takes about " << rough_time(whole);
  if (beside)
    console_.err << ", and " << rough_time(2 * whole)
                 << " with its verification by half the step on another core (--no-verify leaves "
                    "that out)";
  console_.err << '\n' << std::flush;
}

// Adaptive methods may take many steps for one of ours.
void Run::mention_long_step() {
  if (long_told_ || request_.quiet || watch_.seconds() < kLong) return;
  long_told_ = true;
  const Track* const track = study::furthest_behind(tracks_);
  if (!track) return;
  progress_.clear();
  console_.err << "sim: note: " << rough_time(kLong)
               << " are over at t = " << brief(track->system().t()) << " s of "
               << brief(track->end()) << " s: the method takes many steps within one\n"
               << std::flush;
}

void Run::verify() {
  const auto say = [&](double usual, double chaotic) {
    if (request_.quiet || chaotic < kLong) return;
    console_.err << "sim: note: verifying with half the step takes about " << rough_time(usual)
                 << " more, and " << rough_time(chaotic)
                 << " where the motion is chaotic; Ctrl-C skips it\n"
                 << std::flush;
  };
  study::verify(request_.verify, tracks_, seconds_, SessionSignals::any, say);
  for (std::size_t i = 0; i < choices_.size(); ++i)
    if (choices_[i]) report::take_missed_pulse(tracks_[i], *choices_[i]);
}

// The last frames of a run that an error ended. A repeated error was reported.
void Run::take_last() {
  for (Track& track : tracks_) {
    try {
      outputs_.take(index_of(track), track, true);
    } catch (const std::exception&) {
      continue;
    }
  }
}

int Run::go() {
  Interrupts interrupts(request_.snap.has_value());
  int caught = 0;
  bool complete = false;
  try {
    caught = take_steps(interrupts);
    complete = true;
  } catch (...) {
    outputs_.fail();
    take_last();
  }
  // A run that fails before its first step, or for want of a reader, replaces nothing; but a
  // checkpoint that was asked for is made with all that belongs to it.
  const bool began = std::ranges::any_of(tracks_, [](const Track& t) { return t.taken() > 0; });
  const bool worth = complete ? !outputs_.deserted() : began && !source_->has_engine();
  if (worth || (request_.snap && (complete || began))) {
    outputs_.commit_checkpoint(tracks_);
    interrupts.checkpoint_is_safe();
    outputs_.commit_files();
  }
  int code = 0;
  if (complete && !outputs_.deserted()) {
    try {
      code = conclude(caught);
    } catch (...) {
      outputs_.fail();
    }
  }
  outputs_.tell_written();
  return outputs_.code() ? outputs_.code() : code;
}

// Repeats each diverged system, to find the cause and a remedy; in all for about 2 s or ten times
// the run.
void Run::explain() {
  constexpr double kLeast = 2, kTimes = 10;
  const auto diverged = [](Track& track) { return track.verdict().trust == Trust::kDiverged; };
  const auto count = static_cast<double>(std::ranges::count_if(tracks_, diverged));
  const double seconds = std::max(kLeast, kTimes * seconds_);
  StudyProgress progress(request_.progress, console_);
  explanation_json_.resize(tracks_.size());
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    if (!diverged(track) || progress.caught()) continue;
    const SystemSpec& spec = scene_.spec.systems[i];
    const study::PostMortem found = study::post_mortem(
        {&spec, &registry_, run_options(request_.scene, spec, registry_)},
        track.system().step_count() + 1, track.end(), seconds / count, progress.watch());
    explanation_ += post_mortem_text(found, track.system().name(), request_.scene);
    explanation_json_[i] = post_mortem_json(found);
  }
}

// One line, or one a system with the worst at the end; also in the report where that goes elsewhere
// than the words.
void Run::print_verdicts() {
  std::vector<std::pair<Trust, std::string>> lines;
  for (Track& track : tracks_) {
    const Verdict verdict = track.verdict();
    const std::string name = tracks_.size() > 1 ? track.system().name() + ": " : "";
    lines.emplace_back(verdict.trust, std::string(study::trust_name(verdict.trust)) + ": " + name +
                                          verdict.reason + '\n');
  }
  std::ranges::stable_sort(lines, {}, &std::pair<Trust, std::string>::first);
  std::string text;
  for (const auto& [trust, line] : lines)
    if (!request_.quiet || trust != Trust::kTrusted) text += line;
  if (!request_.quiet && !request_.json && !table_on_standard_output(request_) &&
      !console_.one_place) {
    put(console_.out, text);
    outputs_.flush_words();
  }
  console_.err << text << std::flush;
}

// The report, then the error of a divergence, then the verdict.
int Run::conclude(int caught) {
  if (!caught) verify();
  report_.footer(tracks_, seconds_);
  if (request_.debug_particle) {
    std::ostream& out = words(request_, console_);
    if (!request_.json) print_spring_states(scene_, *request_.debug_particle, out);
    print_adjacency(scene_, *request_.debug_particle, request_.json, out);
  }
  const Verdict verdict = overall_verdict(tracks_);
  outputs_.settle(verdict.trust == Trust::kDiverged);
  if (verdict.trust == Trust::kDiverged && !request_.quiet && !caught) explain();
  std::vector<std::string> choices;
  for (const auto& choice : choices_) choices.push_back(error_choice_json(choice, request_));
  if (request_.json)
    console_.out << summary_json(scene_, tracks_, seconds_, explanation_json_, choices) << '\n';
  outputs_.flush_words();

  const bool adaptive = scene_.systems.front().integrator_info().adaptive;
  if (verdict.trust == Trust::kDiverged)
    print_error(console_.err, "diverged: " + scene_.spec.file + ": " + verdict.reason +
                                  (adaptive ? "; try another --tol or --integrator"
                                            : "; try a smaller --dt or another --integrator"));
  console_.err << explanation_;
  print_verdicts();
  if (replays_ && !caught && verdict.trust != Trust::kDiverged) {
    const std::string remark = replays_->compare(scene_);
    if (!request_.quiet) console_.err << "sim: note: " << remark << '\n';
  }
  if (verdict.trust == Trust::kDiverged) return static_cast<int>(ErrorKind::kDiverged);
  if (request_.checks && !caught)
    for (Track& track : tracks_) check(*request_.checks, track.verdict(), track.system().name());
  if (!caught)
    for (const auto& choice : choices_) check_error_kept(choice, request_);
  return caught ? 128 + caught : 0;
}

}  // namespace

int run(const RunRequest& asked, const Environment& environment, Registry& registry,
        Console& console) {
  check_request(asked);
  collect_leftovers_of(asked);
  if (asked.engine && asked.engine->results.empty())
    engine::make_engine(asked.engine->name, registry);
  RunRequest request = asked;
  std::optional<Checkpoint> saved;
  if (asked.resume) {
    saved = read_checkpoint(*asked.resume);
    complete(request.scene, *saved);
    if (request.engine && !request.engine->results.empty())
      complete_import(request, *saved, registry);
  }
  std::optional<report::Replays> replays;
  if (asked.replay) {
    report::NamedScene named = named_scene(request.scene);
    replays.emplace(*asked.replay).complete(named);
    request.scene = with_scene(request.scene, named);
  }
  check_files(request.out, registry);
  if (const std::string why = cannot_show(); request.out.show && !why.empty()) {
    console.err << "sim: note: --show draws nothing: " << why << '\n';
    request.out.show = false;
  }
  LoadedScene scene = load(request.scene, environment, registry);
  FilePlan plan = plan_of(request, scene.names());
  plan_inputs(scene.spec, registry, plan);
  if (request.export_to.empty()) plan.check();
  if (replays) replays->begin(scene, registry);
  std::vector<Account> accounts;
  if (saved) accounts = resume_all(scene, request.scene, *saved, *asked.resume, registry);
  if (request.from_rest) {
    const Interrupts interrupts;
    bring_to_rest(scene, request.quiet ? nullptr : &console.err);
  }
  if (request.export_page) return export_page(request, scene, environment, plan, console);
  if (request.export_file) return export_state(request, scene, accounts, plan, registry, console);
  if (!request.export_to.empty())
    return export_scene(request, scene, accounts, plan, registry, console);
  if (request.energy && !scene.has_second_order())
    throw Error(ErrorKind::kUsage,
                {"no energy to write", "--energy", "a first-order scene has no energy",
                 "leave --energy out; --dump writes the state"});
  const auto held = [](const SystemSpec& system) { return !system.constraints.empty(); };
  if (request.tension && std::ranges::none_of(scene.spec.systems, held))
    throw Error(ErrorKind::kUsage, {"no tensions", "--tension", "the scene has no constraints",
                                    "the forces of springs are those of --debug-particle"});
  const auto observes = [](const SystemSpec& system) { return !system.observers.empty(); };
  if (request.observe && std::ranges::none_of(scene.spec.systems, observes))
    throw Error(ErrorKind::kUsage,
                {"nothing to observe", "--observe", "the scene says nothing of it",
                 "add observe = { NAME = function(s) ... end } to sim.scene"});
  if (request.debug_particle) {
    check_particle(scene, *request.debug_particle);
    print_adjacency(scene, *request.debug_particle, request.json, words(request, console));
    flush_or_throw(console.out, "standard output");
    if (!request.time && !request.steps) return 0;
  }
  int caught = 0;
  GoalChoices choices = choose_for_error(request, scene, registry, console, caught);
  if (caught != 0) {
    print_error(console.err, "interrupted: no step was chosen yet, and nothing was run");
    return 128 + caught;
  }
  if (request.energy && !request.quiet)
    for (const Simulation& system : scene.systems)
      if (!system.second_order())
        console.err << "sim: note: system '" << system.name()
                    << "' is first-order and has no energy rows\n";
  if (!request.quiet && !accounts.empty() && !accounts.front().doubt.empty())
    console.err << "sim: note: " << accounts.front().doubt << '\n';
  if (!request.quiet)
    for (const std::string& note : scene.notes()) console.err << "sim: note: " << note << '\n';
  return Run(request, scene, accounts, std::move(replays), std::move(choices), registry, console)
      .go();
}

}  // namespace sim::cli
