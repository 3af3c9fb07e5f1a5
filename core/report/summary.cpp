#include "core/report/summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"

namespace sim::report {
namespace {

using study::Track, study::Verdict;

// Values of the integrator's parameters as texts; those without a value are left out.
std::string params_json(const Simulation& system) {
  JsonObject object;
  for (const Param& param : system.method().plugin().params)
    if (system.method().params().has(param.name))
      object.text(param.name, to_text(system.method().params().value(param.name)));
  return object.str();
}

std::string effort_json(const Simulation& system) {
  const IntegratorInfo info = system.integrator_info();
  const Effort effort = system.integrator().effort();
  JsonObject object;
  object.integer("steps", effort.steps)
      .integer("rejected", effort.rejected)
      .integer("evaluations", effort.evaluations);
  if (info.implicit)
    object.integer("newton", effort.newton)
        .integer("factorisations", effort.factorisations)
        .integer("linear", effort.linear)
        .number("residual", effort.residual);
  return object.str();
}

struct NamedFigure {
  const char* name;
  double (*of)(const study::Figures& figures);
  bool flag = false;
};

constexpr NamedFigure kFigures[] = {
    {"energy", [](const study::Figures& f) { return f.energy; }},
    {"dt_share", [](const study::Figures& f) { return f.dt_share; }},
    {"dt_share_at_most", [](const study::Figures& f) -> double { return f.at_most; }, true},
    {"strain",
     [](const study::Figures& f) { return f.strain.a < 0 ? std::nan("") : f.strain.strain; }},
    {"step_error", [](const study::Figures& f) { return f.step_error; }},
    {"momentum", [](const study::Figures& f) { return f.momentum; }},
    {"verified", [](const study::Figures& f) -> double { return f.shadow.verified(); }, true},
    {"position_error", [](const study::Figures& f) { return f.shadow.error; }},
    {"position_share", [](const study::Figures& f) { return f.shadow.share; }},
    {"horizon", [](const study::Figures& f) { return f.shadow.horizon; }},
    {"neighbours", [](const study::Figures& f) { return f.shadow.rate; }},
};

std::string figures_json(const study::Figures& figures) {
  JsonObject object;
  for (const NamedFigure& figure : kFigures)
    figure.flag ? object.flag(figure.name, figure.of(figures) != 0)
                : object.number(figure.name, figure.of(figures));
  return object.str();
}

std::string observed_json(Track& track) {
  JsonObject object;
  const std::span<const double> values = track.observed();
  for (std::size_t i = 0; i < values.size(); ++i) {
    JsonObject each;
    each.number("value", values[i]);
    if (!track.parted().empty())
      each.number("difference", track.parted()[i].at_end)
          .number("difference_most", track.parted()[i].most)
          .number("neighbours", track.parted()[i].neighbours);
    object.json(track.observers()[i].name, each.str());
  }
  for (std::size_t i = 0; i < track.judged().size(); ++i)
    object.json(track.judged()[i].text(), JsonObject()
                                              .number("value", track.figure(i))
                                              .number("difference", track.figure_parted(i))
                                              .number("neighbours", track.figure_spread(i))
                                              .str());
  return object.str();
}

// The states of rigid bodies at the end.
std::string bodies_json(const Simulation& system) {
  std::vector<std::string> list;
  for (int i = 0; i < system.bodies(); ++i) {
    const RigidState state = system.body_state(i);
    const auto numbers = [](const auto& values) {
      std::vector<std::string> texts;
      for (const double value : values) texts.push_back(shortest(value));
      return json_array(texts);
    };
    list.push_back(JsonObject()
                       .text("shape", system.body(i).shape().name())
                       .json("position", numbers(state.center))
                       .json("rotation", numbers(state.quaternion()))
                       .json("turn", numbers(state.quaternion()))  // the old name, for one release
                       .json("velocity", numbers(state.velocity))
                       .json("angular_velocity", numbers(state.angular_velocity))
                       .json("spin", numbers(state.angular_velocity))  // likewise
                       .str());
  }
  return json_array(list);
}

std::string system_json(Track& track, const std::string& post_mortem, const std::string& choice) {
  const Simulation& system = track.system();
  const Verdict verdict = track.verdict();
  JsonObject object;
  object.text("name", system.name()).integer("order_of_state", system.second_order() ? 2 : 1);
  if (system.flat()) {
    object.integer("components", system.components());
  } else {
    object.integer("particles", system.particles()).integer("pinned", system.pinned_count());
  }
  if (system.second_order()) {
    JsonObject springs;
    for (const auto& [family, count] : system.families()) springs.integer(family, count);
    object.json("springs", springs.str());
    if (system.bodies() > 0) object.json("bodies", bodies_json(system));
  }
  object.text("integrator", system.method().name())
      .number("dt", system.h())
      .integer("steps", system.step_count())
      .number("t", system.t())
      .number("last_step", track.finished() ? track.short_step().value_or(system.h()) : system.h())
      .flag("began_anew", track.began_anew());
  object.json("integrator_params", params_json(system)).json("effort", effort_json(system));
  if (system.second_order()) {
    object.json("energy", JsonObject()
                              .number("start", track.start_energy().total())
                              .number("end", track.energy().total())
                              .number("work", track.work())
                              .number("drift", track.drift())
                              .str());
  }
  if (!track.observers().empty()) object.json("observed", observed_json(track));
  if (track.has_exact()) object.number("error", track.deviation().error);
  object.text("hash", hash_text(system))
      .text("verdict", study::trust_name(verdict.trust))
      .text("reason", verdict.reason)
      .json("figures", figures_json(verdict.figures));
  if (!choice.empty()) object.json("error_goal", choice);
  if (!post_mortem.empty()) object.json("postmortem", post_mortem);
  return object.str();
}

}  // namespace

double figure_named(const study::Figures& figures, const std::string& name) {
  std::vector<std::string> known;
  for (const NamedFigure& figure : kFigures) {
    if (figure.name == name) return figure.of(figures);
    known.push_back(figure.name);
  }
  throw Error(ErrorKind::kUsage,
              {"unknown figure", "'" + name + "'", "no verdict has it", suggestion(name, known)});
}

std::string summary_json(const StudiedScene& scene, std::span<Track> tracks, double seconds,
                         std::span<const std::string> post_mortems,
                         std::span<const std::string> choices) {
  std::vector<std::string> systems;
  std::string post_mortem;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const std::string own = i < post_mortems.size() ? post_mortems[i] : "";
    systems.push_back(system_json(tracks[i], own, i < choices.size() ? choices[i] : ""));
    if (post_mortem.empty()) post_mortem = own;
  }
  const Verdict verdict = study::overall_verdict(tracks);
  int threads = 1;
  for (const Simulation& system : scene.systems) threads = std::max(threads, system.threads());
  JsonObject object;
  object.text("scene", scene.spec.file)
      .json("systems", json_array(systems))
      .integer("threads", threads)
      .number("seconds", seconds)
      .text("verdict", study::trust_name(verdict.trust))
      .text("reason", verdict.reason);
  if (!post_mortem.empty()) object.json("postmortem", post_mortem);
  return object.str();
}

std::string hash_text(const Simulation& system) {
  std::array<char, 20> text;
  std::snprintf(text.data(), text.size(), "%016llx",
                static_cast<unsigned long long>(system.hash()));
  return text.data();
}

long spring_count(const Simulation& system) {
  long count = 0;
  for (const auto& [family, springs] : system.families()) count += springs;
  return count;
}

std::string SceneCounts::json(const std::string& file) const {
  return JsonObject()
      .text("file", file)
      .integer("particles", particles)
      .integer("springs", springs)
      .str();
}

SceneCounts counts_of(const StudiedScene& scene) {
  SceneCounts counts;
  for (const Simulation& system : scene.systems) {
    counts.particles += system.particles();
    counts.springs += spring_count(system);
  }
  return counts;
}

}  // namespace sim::report
