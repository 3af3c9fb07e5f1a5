// Commands that show or change the state.
#include <cmath>
#include <sstream>

#include "cli/prompt/repl_actions.h"
#include "core/base/error.h"
#include "core/output/format.h"
#include "core/output/tables.h"
#include "core/report/summary.h"

namespace sim::cli::actions {
namespace {

// The text that `print` writes to a stream.
template <class Print>
std::string captured(Print print) {
  std::ostringstream stream;
  print(stream);
  return stream.str();
}

// Splits a table into its header and its rows, so that a header is not repeated.
CsvText split_table(const std::string& text) {
  const std::size_t end = text.find('\n') + 1;
  return {text.substr(0, end), text.substr(end)};
}

Target stream_target(Mode mode) {
  return {"-", mode == Mode::kJson ? TableFormat::kJsonLines : TableFormat::kCsv};
}

TableScope scope_of(const std::vector<const Simulation*>& systems, const LiveScene& live) {
  return {systems, live.scene().spec.world};
}

std::string table_text(Session& session, Mode mode, const std::string& text) {
  if (mode == Mode::kJson) return text;
  session.say_rows(split_table(text));
  return "";
}

Answer for_each_particle(Call& call, Action::What what) {
  call.take(1, static_cast<std::size_t>(-1));
  for (std::size_t i = 0; i < call.count(); ++i) call.particle(i);  // all are there, or none
  for (std::size_t i = 0; i < call.count(); ++i)
    call.session.live().act({.what = what, .particle = call.particle(i)});
  return {};
}

// Empty for an unknown value.
Data known(double value) { return std::isnan(value) ? Data() : Data(value); }

}  // namespace

Answer energy(Call& call) {
  call.take(0, 0);
  LiveScene& live = call.session.live();
  const Simulation& system = live.system();
  if (!system.second_order()) call.wrong("a first-order system has no energy");
  const Energy now = system.energy();
  const double drift = live.drift(live.current(), now), work = live.work(live.current());
  Data value(std::vector<std::pair<Data, Data>>{{"step", std::int64_t{system.step_count()}},
                                                {"t", system.t()},
                                                {"kinetic", now.kinetic},
                                                {"potential", now.potential},
                                                {"total", now.total()},
                                                {"work", known(work)},
                                                {"drift", known(drift)}});
  if (!call.spoken) return {value};
  return {value, [&call, now, work, drift](Mode mode) -> std::optional<std::string> {
            LiveScene& scene = call.session.live();
            if (mode == Mode::kText)
              return captured([&](std::ostream& out) {
                std::vector<Track> tracks;
                tracks.push_back(scene.track(scene.current()));
                Report report(&out, scene.scene());
                out << report.columns(tracks);
                report.row(tracks.front());
              });
            const std::vector<const Simulation*> systems{&scene.system()};
            return table_text(call.session, mode, captured([&](std::ostream& out) {
                                EnergyTable table(stream_target(mode), out,
                                                  scope_of(systems, scene));
                                table.row(scene.system(), now, work, drift);
                                table.commit();
                              }));
          }};
}

Answer position(Call& call) {
  call.take(1, 1);
  return {call.session.live().system().position(call.particle(0))};
}

Answer velocity(Call& call) {
  call.take(1, 1);
  const Simulation& system = call.session.live().system();
  if (!system.second_order()) call.wrong("a first-order system has no velocities");
  return {system.velocity(call.particle(0))};
}

Answer component(Call& call) {
  call.take(1, 1);
  const Simulation& system = call.session.live().system();
  if (system.second_order()) call.wrong("a system of particles has positions and velocities");
  const std::int64_t i = call.integer(0, 0, "a component");
  if (i >= system.components())
    call.wrong("there are " + counted(system.components(), "component"));
  return {system.component(static_cast<int>(i))};
}

Answer set_position(Call& call) {
  const int i = call.particle(0);
  const Vec3 x = call.vector(1, "a position");
  call.session.live().act({.what = Action::What::kPosition, .particle = i, .x = x});
  return {};
}

Answer set_velocity(Call& call) {
  const int i = call.particle(0);
  const Vec3 v = call.vector(1, "a velocity");
  call.session.live().act({.what = Action::What::kVelocity, .particle = i, .x = v});
  return {};
}

Answer set_component(Call& call) {
  call.take(2, 2);
  const auto i = static_cast<int>(
      std::min<std::int64_t>(call.integer(0, 0, "a component"), std::int64_t{1} << 30));
  const double value = call.number(1, -INFINITY, "a value");
  call.session.live().act({.what = Action::What::kComponent, .particle = i, .value = value});
  return {};
}

Answer pin(Call& call) { return for_each_particle(call, Action::What::kPin); }

Answer unpin(Call& call) { return for_each_particle(call, Action::What::kUnpin); }

Answer hand(Call& call) {
  call.take(1, 1);
  LiveScene& live = call.session.live();
  const Action action = parse_action(call.text(0, "an action"));
  if (action.what == Action::What::kIntegrator)
    live.set_integrator(parse_integrator(action.name));
  else
    live.act(action);
  return {};
}

Answer toggle(Call& call) {
  call.take(0, 2);
  LiveScene& live = call.session.live();
  const auto switches = live.system().switches();
  if (call.count() == 0) {
    std::vector<Data> list;
    for (const auto& [name, on] : switches)
      list.emplace_back(std::vector<std::pair<Data, Data>>{{"name", name}, {"on", on}});
    return {list};
  }
  const std::string name = call.text(0, "a switch");
  const auto known = std::ranges::find(switches, name, &std::pair<std::string, bool>::first);
  bool on = known == switches.end() || !known->second;
  if (call.count() == 2) {
    const std::string wanted = call.text(1, "on or off");
    if (wanted != "on" && wanted != "off") call.wrong("a switch is on or off");
    on = wanted == "on";
  }
  live.act({.what = Action::What::kSwitch, .on = on, .name = name});
  return {name + (on ? " on" : " off")};
}

// The forces and their sum, which moves the particle unless it is pinned.
Answer forces(Call& call) {
  call.take(1, 1);
  const Simulation& system = call.session.live().system();
  if (!system.second_order()) call.wrong("a first-order system has no forces");
  const int particle = call.particle(0);
  std::vector<ForceShare> shares = system.forces_on(particle);
  ForceShare sum{"sum", Vec3::Zero()};
  for (const ForceShare& share : shares) sum.force += share.force;
  shares.push_back(sum);
  std::vector<Data> list;
  std::size_t width = 5;
  for (const ForceShare& share : shares) width = std::max(width, share.name.size());
  std::string text = left("force", width);
  for (const char* head : {"x [N]", "y [N]", "z [N]", "size [N]"}) text += right(head, 14);
  text += "\n";
  for (const ForceShare& share : shares) {
    const Vec3& f = share.force;
    list.emplace_back(std::vector<std::pair<Data, Data>>{
        {"force", share.name}, {"x", f[0]}, {"y", f[1]}, {"z", f[2]}, {"size", f.stableNorm()}});
    text += left(share.name, width);
    for (const double value : {f[0], f[1], f[2], f.stableNorm()}) text += right(brief(value), 14);
    text += "\n";
  }
  if (system.pinned(particle))
    text += "particle " + std::to_string(particle) + " is pinned: they do not move it\n";
  return words(text, list);
}

// Shows all systems of a world, as a run of `sim` does.
Answer dump(Call& call) {
  call.take(0, 1);
  Session& session = call.session;
  std::vector<const Simulation*> systems;
  for (const Simulation& system : session.live().scene().systems) systems.push_back(&system);
  const auto write = [&](const Target& target, std::ostream& out) {
    DumpTable table(target, out, scope_of(systems, session.live()));
    for (const Simulation* system : systems) table.frame(*system);
    table.commit();
  };
  const Target target = call.count() > 0 ? parse_target(".dump", call.text(0, "a file"))
                                         : stream_target(session.mode);
  if (target.standard_output()) {
    session.say(table_text(session, session.mode,
                           captured([&](std::ostream& out) { write(target, out); })));
  } else {
    session.check_output(".dump", target.file);
    write(target, session.console().out);
  }
  return {};
}

Answer hash(Call& call) {
  call.take(0, 0);
  const LoadedScene& scene = call.session.live().scene();
  if (!scene.spec.world)
    return words(hash_text(scene.systems.front()) + "\n", hash_text(scene.systems.front()));
  std::string text;
  std::vector<std::pair<Data, Data>> fields;
  for (const Simulation& system : scene.systems) {
    text += hash_text(system) + "  " + system.name() + "\n";
    fields.emplace_back(system.name(), hash_text(system));
  }
  return words(text, fields);
}

}  // namespace sim::cli::actions
