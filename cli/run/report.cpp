#include "cli/run/report.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "cli/terminal/console.h"
#include "core/output/format.h"
#include "core/report/summary.h"

namespace sim::cli {
namespace {

constexpr std::size_t kStepWidth = 9, kTimeWidth = 10, kNumberWidth = 12;
constexpr int kDigits = 5;
constexpr int kShownComponents = 3;

std::int64_t steps_taken(std::span<Track> tracks) {
  std::int64_t steps = 0;
  for (const Track& track : tracks) steps += track.taken();
  return steps;
}

// Right-aligned in a column, with a space before it however long it is.
std::string cell(const std::string& text, std::size_t width) {
  return " " + right(text, width - 1);
}

// The system with the most remaining steps stands for the whole run.
const Track& slowest(std::span<Track> tracks) {
  return *std::min_element(tracks.begin(), tracks.end(), [](const Track& a, const Track& b) {
    return a.system().t() < b.system().t();
  });
}

// "dopri5, order 5, 6 evaluations a step, tol = 1e-06": the tolerance, and parameters that were
// given another value than their default.
std::string integrator_line(const Simulation& system) {
  const IntegratorInfo info = system.integrator_info();
  std::string text = system.method().name() + ", order " + std::to_string(info.order);
  if (info.evaluations > 0) text += ", " + counted(info.evaluations, "evaluation") + " a step";
  for (const Param& param : system.method().plugin().params) {
    const std::string value = to_text(system.method().params().value(param.name));
    if (value != to_text(param.default_value) || (info.adaptive && param.name == "tol"))
      text += ", " + param.name + " = " + value;
  }
  return text;
}

// The effort of the run, where the number of steps does not tell it.
std::string effort_line(const Simulation& system) {
  const IntegratorInfo info = system.integrator_info();
  const Effort effort = system.integrator().effort();
  std::string text = counted(effort.evaluations, "evaluation") + " of f";
  if (info.adaptive)
    text = counted(effort.steps, "step") + " of its own, " + std::to_string(effort.rejected) +
           " rejected; " + text;
  if (info.implicit) {
    text += ", " + counted(effort.newton, "Newton iteration");
    if (effort.factorisations > 0) text += ", " + counted(effort.factorisations, "factorisation");
    if (effort.linear > 0) text += ", " + counted(effort.linear, "linear iteration");
    text += ", residual " + brief(effort.residual, 3);
  }
  return text;
}

std::string families(const Simulation& system) {
  std::vector<std::string> parts;
  for (const auto& [family, count] : system.families())
    parts.push_back(std::to_string(count) + " " + family);
  const std::string total = std::to_string(spring_count(system));
  return parts.empty() ? total : total + ": " + join(parts, ", ");
}

std::string finer_words(const Simulation& system) {
  return system.integrator_info().adaptive ? "a tenth of the tolerance " : "half the step ";
}

// "; with half the step 2e-07 away", "; chaotic, known to 0.3: with half the step 0.2 away, from
// neighbouring starts up to 0.3", or "; not verified". `way`: further on the way, 0 for none.
std::string known_words(const Track& track, double parted, double way, double spread) {
  if (std::isnan(parted)) return track.taken() > 0 ? "; not verified" : "";
  std::string text = "with " + finer_words(track.system()) + brief(parted, 2) + " away";
  if (way > parted) text += ", on the way " + brief(way, 2);
  if (!track.chaotic()) return "; " + text;
  if (std::isnan(spread)) return "; chaotic, not known how well: " + text;
  return "; chaotic, known to " + brief(std::max(parted, spread), 2) + ": " + text +
         ", from neighbouring starts up to " + brief(spread, 2);
}

std::string observed_line(Track& track, std::size_t i) {
  const study::ObservedDeviation parted =
      track.parted().empty() ? study::ObservedDeviation{std::nan(""), 0} : track.parted()[i];
  return track.observers()[i].name + " = " + brief(track.observed()[i], 8) +
         known_words(track, parted.at_end, parted.most, parted.neighbours);
}

std::string figure_line(const Track& track, std::size_t i) {
  const study::Quantity& asked = track.judged()[i];
  const double value = track.figure(i);
  if (std::isnan(value) && asked.is_period())
    return asked.text() + ": it rises through its mean less than twice";
  return asked.text() + " = " + brief(value, 8) +
         known_words(track, track.figure_parted(i), 0, track.figure_spread(i));
}

// Points show where particle 0 is, flat states their first components.
std::vector<double> shown_state(const Simulation& system) {
  std::vector<double> values;
  if (system.flat()) {
    for (int i = 0; i < std::min(kShownComponents, system.components()); ++i)
      values.push_back(system.component(i));
  } else if (system.particles() > 0) {
    const Vec3 x = system.position(0);
    values.assign({x[0], x[1], x[2]});
  }
  return values;
}

}  // namespace

Progress::Progress(std::ostream& err, bool on)
    : err_(err), on_(on), begin_(Clock::now()), last_(begin_) {}

void Progress::update(std::span<Track> tracks) {
  if (!on_) return;
  const Clock::time_point now = Clock::now();
  if (now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  const double seconds = std::chrono::duration<double>(now - begin_).count();
  const Track& track = slowest(tracks);
  std::string line = "t = " + brief(track.system().t(), 4) + " of " + brief(track.end(), 4) +
                     " s   " + brief(static_cast<double>(steps_taken(tracks)) / seconds, 3) +
                     " steps/s   " + brief(track.elapsed() / seconds, 3) + " x real time";
  for (Track& each : tracks)
    if (each.system().second_order() && tracks.size() == 1)
      line += "   drift " + brief(each.drift(), 3) + " J";
  put_control(err_, "\r");
  err_ << line;
  put_control(err_, "\x1b[K");
  err_ << std::flush;
  drawn_ = true;
}

void Progress::clear() {
  if (drawn_) put_control(err_, "\r\x1b[K");
  err_ << std::flush;
  drawn_ = false;
}

void Report::header(std::span<Track> tracks, const std::string& engine) {
  if (!out_) return;
  std::string text;
  if (scene_.spec.world) text += label("scene", scene_.spec.file);
  for (const Track& track : tracks) {
    const Simulation& system = track.system();
    if (scene_.spec.world) {
      text += '\n' + label("system", system.name());
      name_width_ = std::max(name_width_, system.name().size());
    } else {
      text += label("scene", system.name() + ", " + scene_.spec.file);
    }
    if (system.second_order()) {
      text += label("particles", std::to_string(system.particles()) +
                                     (system.pinned_count() > 0
                                          ? ", " + std::to_string(system.pinned_count()) + " pinned"
                                          : ""));
      if (system.bodies() > 0) text += label("bodies", std::to_string(system.bodies()));
      text += label("springs", families(system));
      std::string off;
      for (const std::string& name : system.settings().off) off += (off.empty() ? "" : ", ") + name;
      if (!off.empty()) text += label("off", off);
    } else {
      text +=
          label("state", system.flat() ? counted(system.components(), "number")
                                       : counted(system.particles(), "point") + ", first order");
    }
    const IntegratorInfo info = system.integrator_info();
    text += label("integrator", integrator_line(system));
    std::string steps =
        info.adaptive ? "chosen by the error; " + counted(track.steps(), "state") + ", one every " +
                            brief(system.h()) + " s, to t = " + brief(track.end()) + " s"
                      : brief(system.h()) + " s, " + counted(track.steps(), "step") +
                            " to t = " + brief(track.end()) + " s";
    if (const auto last = track.short_step()) steps += ", the last after " + brief(*last, 4) + " s";
    text += label("step", steps);
  }
  if (!engine.empty()) text += label("engine", engine);
  put(*out_, text + '\n' + columns(tracks));
}

// The heads of the columns. A world mixes systems, so its rows name their numbers themselves.
std::string Report::columns(std::span<Track> tracks) {
  std::string head;
  if (scene_.spec.world) head += left("system", name_width_);
  head += right("step", kStepWidth) + cell("t [s]", kTimeWidth);
  if (!scene_.spec.world) {
    Track& track = tracks.front();
    std::vector<std::string> names;
    if (track.system().second_order()) {
      names = {"kinetic", "potential", "total", "work", "drift [J]"};
    } else {
      const auto shown = static_cast<int>(shown_state(track.system()).size());
      for (int i = 0; i < shown; ++i)
        names.push_back(track.system().flat() ? "x" + std::to_string(i)
                                              : std::string(1, static_cast<char>('x' + i)) + "0");
      if (track.has_exact()) names.push_back("error");
    }
    for (const std::string& name : names) head += cell(name, kNumberWidth);
  }
  return head + '\n';
}

void Report::row(Track& track) {
  if (!out_) return;
  const Simulation& system = track.system();
  std::string line;
  if (scene_.spec.world) line += left(system.name(), name_width_);
  line += right(std::to_string(system.step_count()), kStepWidth) +
          cell(brief(system.t()), kTimeWidth) + measures(track);
  put(*out_, line + '\n');
}

std::string Report::measures(Track& track) const {
  const Simulation& system = track.system();
  std::vector<double> values = shown_state(system);
  if (scene_.spec.world) {
    if (system.second_order())
      return "  energy " + brief(track.energy().total()) + " J, drift " + brief(track.drift(), 4) +
             " J";
    std::vector<std::string> parts;
    for (const double value : values) parts.push_back(brief(value));
    std::string text = "  x0 = " + join(parts, " ");
    if (track.has_exact()) text += ", error " + brief(track.deviation().error, 4);
    return text;
  }
  if (system.second_order()) {
    const Energy& energy = track.energy();
    values = {energy.kinetic, energy.potential, energy.total(), track.work(), track.drift()};
  } else if (track.has_exact()) {
    values.push_back(track.deviation().error);
  }
  std::string text;
  for (const double value : values)
    text += cell(std::isnan(value) ? "-" : brief(value, kDigits), kNumberWidth);
  return text;
}

void Report::footer(std::span<Track> tracks, double seconds) {
  if (!out_) return;
  const auto steps = static_cast<double>(steps_taken(tracks));
  std::string text = "\n";
  const int threads = scene_.threads();
  if (steps > 0 && seconds > 0) {
    text += label("ran", brief(steps, 15) + " steps in " + brief(seconds, 3) +
                             " s: " + brief(1e6 * seconds / steps, 3) + " us a step, " +
                             brief(slowest(tracks).elapsed() / seconds, 3) + " x real time" +
                             (threads > 1 ? ", " + counted(threads, "thread") : ""));
  }
  for (const Track& track : tracks)
    if (track.began_anew())
      text += label("last step", brief(*track.short_step(), 4) +
                                     " s: " + track.system().method().name() +
                                     " keeps earlier steps, and began anew for it");
  for (const Track& track : tracks) {
    const Simulation& system = track.system();
    const IntegratorInfo info = system.integrator_info();
    if ((info.adaptive || info.implicit) && system.integrator().effort().evaluations > 0)
      text +=
          label("effort", effort_line(system) + (scene_.spec.world ? "  " + system.name() : ""));
  }
  for (Track& track : tracks) {
    const std::string name = scene_.spec.world ? "  " + track.system().name() : "";
    const std::size_t values = track.observed().size();
    for (std::size_t i = 0; i < values; ++i)
      text += label(i == 0 ? "observed" : "", wrapped(observed_line(track, i) + name, 12, 12));
    for (std::size_t i = 0; i < track.judged().size(); ++i)
      text += label("", wrapped(figure_line(track, i) + name, 12, 12));
  }
  for (const Track& track : tracks) {
    text += label("hash", hash_text(track.system()) +
                              (scene_.spec.world ? "  " + track.system().name() : ""));
  }
  put(*out_, text);
}

}  // namespace sim::cli
