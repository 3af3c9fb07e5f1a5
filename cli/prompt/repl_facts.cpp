// Commands that show the contents of a scene, and commands that open others.
#include <cmath>
#include <sstream>

#include "cli/prompt/repl_actions.h"
#include "cli/verbs/adjacency.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/output/output.h"

namespace sim::cli::actions {
namespace {

const Simulation& with_masses(Call& call) {
  const Simulation& system = call.session.live().system();
  if (!system.second_order()) call.wrong("a first-order system has no masses, pins and springs");
  return system;
}

Data value_of(const Value& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag;
  if (const auto* number = std::get_if<double>(&value)) {
    const double whole = std::floor(*number);
    if (whole == *number && std::abs(whole) < 9e15) return static_cast<std::int64_t>(whole);
    return *number;
  }
  return to_text(value);
}

}  // namespace

Answer n(Call& call) {
  call.take(0, 0);
  const Simulation& system = call.session.live().system();
  return {std::int64_t{system.flat() ? system.components() : system.particles()}};
}

Answer mass(Call& call) {
  call.take(1, 1);
  with_masses(call);
  return {call.session.live().spec().particles->at(call.particle(0)).mass};
}

Answer pins(Call& call) {
  call.take(0, 0);
  std::vector<Data> ids;
  for (const int id : with_masses(call).settings().pinned) ids.emplace_back(id);
  return {ids};
}

Answer args(Call& call) {
  call.take(0, 0);
  std::vector<std::pair<Data, Data>> fields;
  for (const SceneArg& arg : call.session.live().scene().spec.args)
    fields.emplace_back(arg.name, value_of(arg.value));
  return {fields};
}

// The list as `sim adjacency` prints it, with the length and strain of each spring.
Answer springs(Call& call) {
  call.take(1, 1);
  const Simulation& system = with_masses(call);
  LiveScene& live = call.session.live();
  const int particle = call.particle(0);
  std::vector<Data> list;
  for (const Link& link : system.links(particle)) {
    const double length = (system.position(particle) - system.position(link.to)).stableNorm();
    list.emplace_back(std::vector<std::pair<Data, Data>>{{"family", link.family},
                                                         {"to", link.to},
                                                         {"stiffness", link.stiffness},
                                                         {"rest", link.rest},
                                                         {"length", length},
                                                         {"strain", length / link.rest - 1},
                                                         {"force", link.tension(length)}});
  }
  return {list, [&live, &system, particle](Mode mode) -> std::optional<std::string> {
            if (mode == Mode::kCsv) return {};
            const ParticleChoice choice{system.name(), particle};
            std::ostringstream out;
            print_adjacency(live.scene(), choice, mode == Mode::kJson, out);
            if (mode == Mode::kText) print_spring_states(live.loaded(), choice, out);
            return out.str();
          }};
}

Answer open(Call& call) {
  call.take(1, 1);
  Session& session = call.session;
  session.live().open(call.text(0, "a scene"));
  if (call.spoken) session.tell(session.facts());
  return {};
}

Answer load(Call& call) {
  call.take(1, 1);
  call.session.registry().load(call.text(0, "a plugin library"));
  return {};
}

Answer save(Call& call) {
  call.take(1, 1);
  const std::string file = call.text(0, "a file");
  if (file == "-") return words(call.session.script());
  call.session.check_output(".save", file);
  Output output({file}, call.session.console().out);
  output.buffer() += call.session.script();
  output.commit();
  return {};
}

}  // namespace sim::cli::actions
