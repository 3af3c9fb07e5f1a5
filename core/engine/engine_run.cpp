#include "core/engine/engine_run.h"

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/output.h"
#include "core/output/read_file.h"
#include "core/report/study_words.h"
#include "core/study/run/run_length.h"
#include "core/study/verdict/sampling_schedule.h"

namespace sim::engine {

using report::counted, study::kMostSteps, study::Track;

namespace {

// Steps between states for the work of drag. Scenes of few particles write often, within gigabytes
// of disk; scenes of many as often as our own runs look (see EnergyBalance), but one process writes
// the states of all: the more processes, the fewer states, and for an unknown number the states of
// the verdict are enough.
std::int64_t work_stride(const Track& track, std::int64_t steps, int ranks) {
  constexpr double kMostFrames = 1e5, kMostBytes = 2e9;
  constexpr int kParticlesPerStep = 2048, kMostSteps = 16;
  constexpr int kColumns = 10;  // numbers of a particle in a state, of whoever writes the most
  const int n = track.system().particles();
  const double frames = std::clamp(kMostBytes / (8.0 * kColumns * n), 1.0, kMostFrames);
  const auto stride = static_cast<std::int64_t>(std::ceil(static_cast<double>(steps) / frames));
  if (n <= kParticlesPerStep) return std::max<std::int64_t>(1, stride);
  if (ranks == 0) return Track::kNever;
  return std::max<std::int64_t>(stride, ranks * std::clamp(n / kParticlesPerStep, 1, kMostSteps));
}

}  // namespace

std::unique_ptr<Engine> make_engine(const std::string& name, Registry& registry) {
  if (!registry.find(kind_of<Engine>, name))
    throw Error(ErrorKind::kUsage, {"unknown engine", "'" + name + "'", "no plugin has that name",
                                    suggestion(name, registry.names<Engine>())});
  const auto& plugin = registry.get<Engine>(name);
  return made(plugin.make(Params(plugin.title(), plugin.params, {}, "")), plugin);
}

std::vector<std::int64_t> moments_of(Track& track, std::span<const std::int64_t> strides, int ranks,
                                     const MoreMoments& more) {
  constexpr double kMost = 5e7;
  const Simulation& system = track.system();
  const std::int64_t first = system.step_count();
  const std::int64_t last = track.steps() - (track.short_step() ? 1 : 0);
  if (last <= first) return {first};
  std::vector<std::int64_t> all(strides.begin(), strides.end());
  if (!system.conserves_energy()) all.push_back(work_stride(track, last - first, ranks));
  double count = 0;
  for (const std::int64_t stride : all)
    count += static_cast<double>(last - first) / static_cast<double>(stride);
  if (count > kMost)
    throw Error(ErrorKind::kUsage,
                {"too many states", brief(count, 2) + " rows of tables",
                 "an engine writes each of them to the disk", "choose fewer, as in --every 1000"});
  std::set<std::int64_t> steps{first, last};
  for (const std::int64_t stride : all) {
    if (stride == Track::kNever) continue;
    for (std::int64_t step = first + stride - first % stride; step < last; step += stride)
      steps.insert(step);
  }
  study::SamplingSchedule looks(first, track.steps());
  for (std::int64_t step = looks.next(); step < last; step = looks.next()) {
    steps.insert(std::max(first, step));
    looks.take(step);
  }
  if (more) more(last, [&](std::int64_t step) { steps.insert(step); });
  steps.insert(std::min(last, first + kExactSteps));
  return {steps.begin(), steps.end()};
}

void write_engine_notes(const EngineNotes& notes, const std::string& folder) {
  Output file(folder + "/" + kEngineNotes);
  file.buffer() = "engine " + notes.engine + "\n" +
                  (notes.steps ? "steps " + std::to_string(*notes.steps)
                               : "time " + shortest(notes.time.value_or(0))) +
                  "\nevery " + std::to_string(notes.every) + '\n';
  for (const std::string& name : notes.without) file.buffer() += "without " + name + '\n';
  file.commit();
}

EngineNotes read_engine_notes(const std::string& folder, Registry& registry) {
  constexpr const char* kRemedy = "give a folder that sim export wrote";
  const std::string file = folder + "/" + kEngineNotes;
  const std::string text = read_input_file(file, 100e3, kRemedy);
  EngineNotes notes;
  bool known = false, good = true;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t space = std::min(line.find(' '), line.size());
    const std::string name = line.substr(0, space),
                      value = line.substr(std::min(space + 1, line.size()));
    const auto whole = parse_integer(value);
    const auto number = parse_number(value);
    if (name == "engine") {
      notes.engine = value;
      known = registry.find(kind_of<Engine>, value);
    } else if (name == "steps" && whole && *whole >= 0 && *whole <= kMostSteps) {
      notes.steps = whole;
    } else if (name == "time" && number && *number >= 0) {
      notes.time = number;
    } else if (name == "every" && whole && *whole >= 1) {
      notes.every = *whole;
    } else if (name == "without") {
      notes.without.push_back(value);
    } else {
      good = false;
    }
  }
  if (!known || !good || notes.steps.has_value() == notes.time.has_value())
    throw Error(ErrorKind::kCheckpoint,
                {"cannot import", file, "it does not say what was run", "export the scene again"});
  for (const std::string& name : make_engine(notes.engine, registry)->files().results)
    if (const std::string other = folder + "/" + name; std::filesystem::exists(other))
      check_input_file(other, HUGE_VAL, kRemedy);
  return notes;
}

EngineRun::EngineRun(const EngineRequest& request, const SystemSpec& spec, Track& track,
                     std::vector<std::int64_t> moments, Registry& registry,
                     std::function<bool()> stop)
    : request_(request),
      stop_(std::move(stop)),
      last_(moments.back()),
      folder_(request.results),
      engine_(make_engine(request.name, registry)),
      scene_(track.system(), spec, engine_->name(), engine_->methods()) {
  const bool started = request.results.empty() && moments.size() > 1;
  title_ = engine_->name() + ", " + std::string(request.results.empty() ? "" : "results of ") +
           (!request.results.empty()        ? request.results
            : !request.launch.words.empty() ? join(request.launch.words, " ")
                                            : counted(request.launch.ranks, "rank"));
  if (started) {
    if (request.launch.ranks > std::max(1, track.system().particles()))
      throw Error(ErrorKind::kUsage,
                  {"too many ranks", "--ranks " + std::to_string(request.launch.ranks),
                   "there are " + counted(track.system().particles(), "particle"),
                   "some thousand particles are worth a rank"});
    command_ = engine_->command(request.launch);
    temporary_.emplace();
    folder_ = temporary_->path();
    engine_->write(scene_, moments, folder_);
  }
  frames_ = engine_->frames(folder_, scene_, track.system());
  constexpr int kMostCompared = 10'000'000;
  if (request.compare && moments.size() > 1 && track.system().particles() <= kMostCompared)
    take_first_steps(track.system(), last_ - moments.front(), registry);
}

// The kernel solves them to rounding, too, if the engine does.
void EngineRun::take_first_steps(Simulation& system, std::int64_t most, Registry& registry) {
  constexpr double kExact = 1e-12;
  const sim::Method method = system.method();
  const bool solved = engine_->solves() && method.params().has("tol");
  if (solved) {
    MethodChoice exact = method.choice();
    exact.given["tol"] = kExact;
    system.set_integrator(sim::Method(registry, exact));
  }
  first_steps_.emplace(system, most);
  if (solved) system.set_integrator(method);
}

void EngineRun::start() {
  if (!command_.empty()) process_ = engine_->start(command_, folder_);
}

bool EngineRun::advance(Track& track) {
  Simulation& system = track.system();
  if (system.step_count() >= last_) return track.advance(1) > 0;  // a shorter one, of our own
  while (true) {
    const bool ended = !process_ || process_->ended();
    switch (frames_->next(last_)) {
      case Frames::Next::kState:
        if (first_steps_ && system.step_count() == first_steps_->step()) compare(system);
        return true;
      case Frames::Next::kNotFinite:
        track.mark_diverged("in " + engine_->name() + " a number is not finite at step " +
                            std::to_string(frames_->step()) + ", h = " + brief(system.h()) + " s");
        return false;
      case Frames::Next::kNone:
        break;
    }
    if (ended) return give_up(track);
    if (stop_()) return false;
    const timespec moment{0, 5'000'000};
    ::nanosleep(&moment, nullptr);
  }
}

// There is no further state.
bool EngineRun::give_up(Track& track) {
  const EngineLog log = engine_->log(folder_);
  const std::string at =
      "step " + std::to_string(track.system().step_count()) + " of " + std::to_string(last_);
  if (log.halted) {
    track.mark_diverged(log.why + " at step " + std::to_string(*log.halted) +
                        ", h = " + brief(track.system().h()) + " s");
    return false;
  }
  if (!process_)
    throw Error(ErrorKind::kCheckpoint,
                {"results are not whole", folder_,
                 "they end at " + at + (log.error.empty() ? "" : "; " + log.error),
                 "let the run there end, or take what there is: --steps " +
                     std::to_string(track.system().step_count())});
  if (stop_()) return false;
  const std::string said = process_->finish();
  throw Error(ErrorKind::kIo,
              {engine_->name() + " failed", title_ + ", at " + at,
               !log.error.empty() ? log.error
               : said.empty()     ? "it ended too early"
                                  : said,
               std::string(request_.launch.ranks > 1 && ::geteuid() == 0
                               ? "as root mpirun wants OMPI_ALLOW_RUN_AS_ROOT=1 and "
                                 "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1; "
                               : "") +
                   "sim export makes the files to try by hand"});
}

void EngineRun::compare(const Simulation& system) {
  const FirstSteps::Answer answer = first_steps_->compare(system);
  const std::string digits = std::isinf(answer.digits) ? "all" : brief(answer.digits, 3);
  const std::string steps = "step " + std::to_string(system.step_count());
  if (!answer.same)
    throw Error(ErrorKind::kCheck, {engine_->name() + " and the kernel part", title_,
                                    "at " + steps + " they agree to " + digits + " digits only",
                                    request_.without_comparison});
  std::string version = engine_->log(folder_).version;
  if (version.empty()) version = engine_->name();
  note_ = version + " and the kernel agree to " + digits + " digits at " + steps;
}

}  // namespace sim::engine
