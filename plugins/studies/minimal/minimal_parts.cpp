#include "minimal_parts.h"

#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/study/study.h"

namespace sim::studies {
namespace {

// The families of springs by their names, everything else by its plugin.
std::string name_of(const PartSpec& part) {
  if (const auto family = part.given.find("family"); family != part.given.end())
    if (const auto* name = std::get_if<std::string>(&family->second)) return *name;
  return part.plugin;
}

// In a world with the name of the system before theirs.
void add_forces(const SystemSpec& spec, const std::string& before, std::vector<Part>& parts) {
  std::vector<std::string> names;
  for (const std::vector<PartSpec>* list : {&spec.forces, &spec.colliders})
    for (const PartSpec& each : *list) {
      const std::string name = name_of(each);
      if (std::ranges::count(names, name)) continue;
      names.push_back(name);
      const std::string kind = name != each.plugin    ? "family "
                               : list == &spec.forces ? "force "
                                                      : "collider ";
      parts.push_back({kind + before + name, "--without " + before + name, false,
                       [word = before + name](SceneVariant& scene) {
                         scene.without.push_back(word);
                         return true;
                       }});
    }
}

// Numbers of the scene: 0, and n halved.
void add_settings(const SceneSpec& spec, std::vector<Part>& parts) {
  for (const SceneArg& arg : spec.args) {
    const auto* value = std::get_if<double>(&arg.value);
    if (!value || *value == 0) continue;
    const std::string& name = arg.name;
    if (name == "n" || name.ends_with(".n")) {  // of a scene in a world
      const double whole = *value;
      parts.push_back(
          {"half the particles a side", "-s " + name + "=" + shortest(std::floor(whole / 2)), true,
           [whole, name](SceneVariant& scene) {
             const auto now = scene.settings.find(name);
             const double n =
                 now == scene.settings.end() ? whole : parse_number(now->second).value_or(whole);
             if (std::floor(n / 2) < 2) return false;
             scene.settings[name] = shortest(std::floor(n / 2));
             return true;
           }});
      continue;
    }
    parts.push_back({"parameter " + arg.name, "-s " + arg.name + "=0", false,
                     [name = arg.name](SceneVariant& scene) {
                       scene.settings[name] = "0";
                       return true;
                     }});
  }
}

// The method of the same kind that comes next in cost and fits all systems; empty when there is
// none.
std::string simpler(const std::string& now, const std::vector<study::Problem>& problems) {
  std::vector<study::Candidate> methods = study::fitting_methods(problems.front().with({now}), {});
  for (const study::Problem& problem : problems) {
    const auto fitting = study::fitting_methods(problem.with({now}), {});
    std::erase_if(methods, [&](const study::Candidate& method) {
      return std::ranges::find(fitting, method.name, &study::Candidate::name) == fitting.end();
    });
  }
  const auto own = std::ranges::find(methods, now, &study::Candidate::name);
  if (own == methods.end() || own->info.implicit) return {};
  const auto rank = [](const study::Candidate& method) {
    return std::pair(method.info.evaluations, method.info.order);
  };
  const study::Candidate* best = nullptr;
  for (const study::Candidate& method : methods) {
    if (method.info.implicit || method.chooses || method.info.adaptive != own->info.adaptive)
      continue;
    const bool less =
        method.info.evaluations < own->info.evaluations ||
        (method.info.evaluations == own->info.evaluations && method.info.order < own->info.order);
    if (less && (!best || rank(method) > rank(*best) ||
                 (rank(method) == rank(*best) && method.info.symplectic)))
      best = &method;
  }
  return best ? best->name : "";
}

// Adds reductions of the step and the method if all systems share one: options of a run hold for
// all.
void add_method(const StudiedScene& scene, const std::vector<study::Problem>& problems,
                std::vector<Part>& parts) {
  const auto all = [&](auto holds) { return std::ranges::all_of(scene.systems, holds); };
  const double h = scene.systems.front().h();
  if (all([h](const Simulation& system) { return system.h() == h; }))
    parts.push_back({"twice the step", "-d " + shortest(2 * h), true, [h](SceneVariant& next) {
                       next.dt = 2 * (next.dt > 0 ? next.dt : h);
                       return true;
                     }});
  const auto has_precision = [](const Simulation& system) {
    return std::ranges::count(system.method().plugin().params, "precision", &Param::name) > 0 &&
           system.integrator_info().precision == Precision::kDouble;
  };
  if (all(has_precision))
    parts.push_back({"single precision", "--precision single", false, [](SceneVariant& next) {
                       next.integrator.given["precision"] = std::string("single");
                       return true;
                     }});
  const std::string own = scene.systems.front().method().name();
  if (!all([&](const Simulation& system) { return system.method().name() == own; })) return;
  const std::string next_name = simpler(own, problems);
  if (next_name.empty()) return;
  parts.push_back(
      {"a simpler method", "-i " + next_name, true, [own, problems](SceneVariant& next) {
         const std::string now = next.integrator.name.empty() ? own : next.integrator.name;
         const std::string name = simpler(now, problems);
         if (name.empty()) return false;
         const auto precision_of = next.integrator.given.find("precision");
         MethodChoice choice{name};
         if (precision_of != next.integrator.given.end())
           choice.given["precision"] = precision_of->second;
         next.integrator = choice;
         return true;
       }});
}

}  // namespace

std::vector<Part> parts_of(const StudyTask& task, const StudiedScene& scene) {
  std::vector<Part> parts;
  std::vector<study::Problem> problems;
  for (const SystemSpec& spec : scene.spec.systems) {
    add_forces(spec, scene.spec.world ? spec.name + "." : "", parts);
    problems.push_back({&spec, task.registry, task.scene->options(task.variant, spec)});
  }
  add_settings(scene.spec, parts);
  add_method(scene, problems, parts);
  return parts;
}

std::string run_command(const StudyTask& task, const SceneVariant& variant) {
  std::string text = task.scene->command(variant);
  if (!variant.integrator.name.empty()) text += " -i " + variant.integrator.name;
  std::string rest;
  for (const auto& [name, value] : variant.integrator.given) {
    if (name == "precision")
      rest += " --precision " + to_text(value);
    else if (name == "tol")
      rest += " --tol " + to_text(value);
    else if (!variant.integrator.name.empty())
      text += (text.ends_with(variant.integrator.name) ? ":" : ",") + name + "=" + to_text(value);
  }
  text += rest;
  if (variant.dt > 0) text += " -d " + shortest(variant.dt);
  if (task.time) text += " -T " + shortest(*task.time);
  return text;
}

}  // namespace sim::studies
