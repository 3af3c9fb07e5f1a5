#include "cli/run/postmortem.h"

#include <cmath>

#include "core/output/format.h"

namespace sim::cli {
namespace {

using study::PostMortem;
using study::Remedy;

std::string indented_label(const std::string& name, const std::string& text) {
  return wrapped("  " + left(name, 10) + text, 12) + "\n";
}

std::string limit_text(const PostMortem& result) {
  const std::string dt = "dt " + brief(result.dt) + " s";
  if (std::isnan(result.limit_share)) return dt;
  if (std::isinf(result.limit_share)) return dt + "; " + result.integrator + " has no stable one";
  return dt + ", " + brief(100 * result.limit_share, 3) +
         " % of the largest stable one at the start";
}

std::string forces_text(const PostMortem& result) {
  std::vector<std::string> parts;
  for (const auto& [name, force] : result.forces)
    parts.push_back(name + " " + brief(force, 3) + " N");
  return "on particle " + std::to_string(result.particle) + " then: " + join(parts, ", ");
}

std::string remedies_text(const PostMortem& result) {
  std::vector<std::string> parts;
  const auto run = [](const Remedy& remedy) {
    return std::string("run: ") + study::trust_name(remedy.verdict.trust) + ")";
  };
  if (result.smaller)
    parts.push_back("--dt " + brief(result.smaller->dt) + " (" +
                    std::to_string(result.smaller->steps) + " steps, " + run(*result.smaller));
  if (result.other)
    parts.push_back("-i " + result.other->integrator + " at the same dt (" + run(*result.other));
  if (!parts.empty()) return join(parts, ", or ");
  return result.complete ? "nothing that was tried" : "not tried to the end: it takes too long";
}

std::string look_text(const PostMortem& result, const SceneRequest& request) {
  std::string command =
      "sim " + request.scene + " -i " + result.choice + " -d " + shortest(result.dt);
  for (const auto& [name, value] : request.settings) command += " -s " + name + "=" + value;
  const std::string steps = std::to_string(std::max<std::int64_t>(result.since - 1, 0));
  return command + " -n " + steps + " --every " + steps + " --dump=before.csv";
}

std::string remedy_json(const std::optional<Remedy>& remedy) {
  if (!remedy) return "null";
  return JsonObject()
      .text("integrator", remedy->integrator)
      .number("dt", remedy->dt)
      .integer("steps", remedy->steps)
      .text("verdict", study::trust_name(remedy->verdict.trust))
      .str();
}

}  // namespace

std::string post_mortem_text(const PostMortem& result, const std::string& system,
                             const SceneRequest& request) {
  std::string text = "what happened in " + system + '\n';
  text += indented_label("step", limit_text(result));
  if (result.spring) {
    const auto& spring = *result.spring;
    text += indented_label(
        "first", result.family + " spring " + std::to_string(spring.a) + "-" +
                     std::to_string(spring.b) + ", step " + std::to_string(result.since) +
                     ", t = " + brief(result.t, 4) + " s: strain " + brief(100 * spring.strain, 3) +
                     " %, growing x" + brief(result.growth, 3) + " a step from then on");
    text += indented_label("forces", forces_text(result));
    if (result.since > 1) text += "  " + left("look", 10) + look_text(result, request) + '\n';
  }
  return text + indented_label("works", remedies_text(result));
}

std::string post_mortem_json(const PostMortem& result) {
  JsonObject object;
  object.text("integrator", result.integrator)
      .number("dt", result.dt)
      .number("dt_share", result.limit_share)
      .integer("step", result.step);
  if (result.spring) {
    object.json("spring", JsonObject()
                              .integer("a", result.spring->a)
                              .integer("b", result.spring->b)
                              .text("family", result.family)
                              .number("strain", result.spring->strain)
                              .integer("since", result.since)
                              .number("t", result.t)
                              .number("growth", result.growth)
                              .str());
    std::vector<std::string> forces;
    for (const auto& [name, force] : result.forces)
      forces.push_back(JsonObject().text("name", name).number("force", force).str());
    object.integer("particle", result.particle).json("forces", json_array(forces));
  }
  return object.json("smaller", remedy_json(result.smaller))
      .json("other", remedy_json(result.other))
      .str();
}

}  // namespace sim::cli
