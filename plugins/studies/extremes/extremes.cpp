// The verdict on every integrator at the extremes: a map of each.
#include <algorithm>

#include "core/output/format.h"
#include "core/plugin/plugin.h"
#include "core/study/study.h"
#include "extreme_cells.h"

namespace sim::studies {
namespace {

using study::ExtremeCell;
using study::ExtremeMap;
using study::Extremes;
using study::Trust;

constexpr std::size_t kHead = 11;

char mark(const ExtremeCell& cell) {
  if (!cell.run) return '-';
  if (cell.silently_wrong()) return '!';
  return cell.trust == Trust::kTrusted ? '+' : cell.trust == Trust::kSuspect ? '?' : 'x';
}

long count(const ExtremeMap& map, char which) {
  return std::count_if(map.cells.begin(), map.cells.end(),
                       [&](const ExtremeCell& cell) { return mark(cell) == which; });
}

std::string map_text(const Extremes& all, const ExtremeMap& map) {
  const std::size_t width = all.dt.size() + 1;
  std::string text = map.method.label + ": " + std::to_string(count(map, '+')) + " trusted, " +
                     std::to_string(count(map, '?')) + " suspect, " +
                     std::to_string(count(map, 'x')) + " diverged, " +
                     std::to_string(count(map, '-')) + " not run, " +
                     std::to_string(count(map, '!')) + " silently wrong\n";
  std::size_t i = 0;
  const auto row = [&](const std::string& head, std::size_t columns) {
    text += left(head, kHead);
    for (std::size_t column = 0; column < columns; ++column) {
      std::string marks;
      for (std::size_t k = 0; k < all.dt.size() && i < map.cells.size(); ++k)
        marks += mark(map.cells[i++]);
      text += left(marks, width);
    }
    text.erase(text.find_last_not_of(' ') + 1);
    text += '\n';
  };
  text += left("  N/m \\ kg", kHead);
  for (const double mass : all.mass) text += left(brief(mass), width);
  text.erase(text.find_last_not_of(' ') + 1);
  text += '\n';
  for (const double stiffness : all.stiffness) row("  " + brief(stiffness), all.mass.size());
  text += "  m from the origin, at 1000 N/m and 1 kg\n";
  for (const double offset : all.offset) row("  " + brief(offset), 1);
  return text;
}

std::string map_json(const ExtremeMap& map) {
  std::vector<std::string> cells;
  for (const ExtremeCell& cell : map.cells)
    cells.push_back(JsonObject()
                        .number("stiffness", cell.stiffness)
                        .number("mass", cell.mass)
                        .number("dt", cell.dt)
                        .number("offset", cell.offset)
                        .text("verdict", cell.run ? study::trust_name(cell.trust) : "not run")
                        .number("error", cell.error)
                        .text("reason", cell.reason)
                        .str());
  return JsonObject()
      .text("name", map.method.label)
      .integer("trusted", count(map, '+'))
      .integer("suspect", count(map, '?'))
      .integer("diverged", count(map, 'x'))
      .integer("not_run", count(map, '-'))
      .integer("silently_wrong", count(map, '!'))
      .json("cells", json_array(cells))
      .str();
}

class AtTheExtremes final : public Study {
 public:
  std::string run(const StudyTask& task) override {
    const Extremes all = study::extremes(*task.registry, task.integrators, task.watch);
    if (task.json) {
      std::vector<std::string> maps;
      for (const ExtremeMap& map : all.maps) maps.push_back(map_json(map));
      return JsonObject()
          .flag("complete", all.complete)
          .json("integrators", json_array(maps))
          .str();
    }
    std::vector<std::string> steps;
    for (const double dt : all.dt) steps.push_back(brief(dt));
    std::string text =
        "A particle let go on a vertical spring, 60 steps; in each cell a mark for dt = " +
        join(steps, ", ") +
        " s:\n+ trusted  ? suspect  x diverged  - too many steps of its own"
        "  ! trusted, but off by more than 10 %\n";
    for (const ExtremeMap& map : all.maps) text += '\n' + map_text(all, map);
    return text;
  }
};

constexpr const char* kHelp =
    "Keys of --json, one object:\n"
    "  complete, integrators: [name, trusted, suspect, diverged, not_run,\n"
    "  silently_wrong, cells: [stiffness (N/m), mass (kg), dt (s), offset (m),\n"
    "  verdict, error, reason]]\n";

}  // namespace
}  // namespace sim::studies

SIM_PLUGIN(Study, "extremes") {
  registrar.add(sim::Plugin<sim::Study>{
      {.name = "extremes",
       .summary = "is any integrator silently wrong at the extremes?",
       .formula = "sim extremes [--integrators A,B]: a spring at all extremes of stiffness, mass, "
                  "step and distance from the origin"},
      [](const sim::Params&) { return std::make_unique<sim::studies::AtTheExtremes>(); },
      false,
      {"--integrators"},
      sim::studies::kHelp});
}
