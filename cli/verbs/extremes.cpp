#include "cli/verbs/extremes.h"

#include <algorithm>

#include "cli/run/study_progress.h"
#include "core/output/format.h"
#include "core/study/verdict/extremes.h"

namespace sim::cli {
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

}  // namespace

int extremes(const StabilityRequest& request, Registry& registry, Console& console) {
  StudyProgress progress(request.progress, console);
  const Extremes all =
      study::extremes(registry, study_choices(request.integrators, registry), progress.watch());
  progress.clear();
  std::string text;
  if (request.json) {
    std::vector<std::string> maps;
    for (const ExtremeMap& map : all.maps) maps.push_back(map_json(map));
    text = JsonObject().flag("complete", all.complete).json("integrators", json_array(maps)).str() +
           '\n';
  } else {
    std::vector<std::string> steps;
    for (const double dt : all.dt) steps.push_back(brief(dt));
    text = "A particle let go on a vertical spring, 60 steps; in each cell a mark for dt = " +
           join(steps, ", ") +
           " s:\n+ trusted  ? suspect  x diverged  - too many steps of its own"
           "  ! trusted, but off by more than 10 %\n";
    for (const ExtremeMap& map : all.maps) text += '\n' + map_text(all, map);
  }
  put(console.out, text);
  flush_or_throw(console.out, "standard output");
  return progress.exit_code();
}

}  // namespace sim::cli
