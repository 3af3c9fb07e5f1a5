#include "cli/verbs/list.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "cli/verbs/luacats.h"
#include "cli/verbs/reference_page.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/lua/scene/scene_file.h"
#include "core/output/format.h"
#include "core/report/integrator_facts.h"

namespace sim::cli {
namespace {

using report::integrator_facts, report::IntegratorFacts, report::kind_text, report::limit_text;

struct ListRow {
  std::string name, summary = {};
  std::vector<std::string> aliases = {};
  std::optional<IntegratorFacts> facts = {};

  std::string title() const {
    return aliases.empty() ? name : name + " (" + join(aliases, ", ") + ")";
  }
};

ListRow plugin_row(const PluginKind& kind, const std::string& name, Registry& registry) {
  try {
    const PluginInfo& info = registry.get(kind, name);
    return {name, info.summary, info.aliases, integrator_facts(info, registry)};
  } catch (const Error& error) {
    return {name, std::string("cannot be used: ") + error.what()};
  }
}

std::vector<ListRow> plugin_rows(const PluginKind& kind, Registry& registry) {
  std::vector<ListRow> rows;
  for (const std::string& name : registry.names(kind))
    rows.push_back(plugin_row(kind, name, registry));
  return rows;
}

std::vector<ListRow> scene_rows(const Environment& environment) {
  std::vector<ListRow> rows;
  for (const std::string& scene : list_scenes(environment.scene_folders))
    rows.push_back({scene, "", {}});
  return rows;
}

std::string text_section(const std::string& name, const std::vector<ListRow>& rows) {
  std::string text = name + "\n";
  std::size_t width = 0;
  for (const ListRow& row : rows) width = std::max(width, row.title().size());
  for (const ListRow& row : rows)
    text += row.summary.empty()
                ? "  " + row.name + '\n'
                : wrapped("  " + left(row.title(), width) + "  " + row.summary, width + 4) + '\n';
  return text;
}

// Sorted for choosing: by order, then by evaluations; methods without facts come last.
std::string integrator_section(std::vector<ListRow> rows) {
  const auto key = [](const ListRow& row) {
    return row.facts ? std::pair(row.facts->info.order, row.facts->info.evaluations)
                     : std::pair(std::numeric_limits<int>::max(), 0);
  };
  std::stable_sort(rows.begin(), rows.end(),
                   [&](const ListRow& l, const ListRow& r) { return key(l) < key(r); });
  std::size_t width = 4;
  for (const ListRow& row : rows) width = std::max(width, row.title().size());
  const auto line = [&](const std::string& title, const std::string& order,
                        const std::string& evaluations, const std::string& oscillation,
                        const std::string& decay, const std::string& kind) {
    const std::string facts = "  " + left(title, width) + right(order, 7) + right(evaluations, 6) +
                              right(oscillation, 9) + right(decay, 10) + "  ";
    return facts + wrapped(kind, facts.size(), facts.size()) + '\n';
  };
  std::string text = "integrators\n";
  text += line("", "", "f per", "", "stable up to", "");
  text += line("name", "order", "step", "h omega", "h lambda", "kind");
  for (const ListRow& row : rows) {
    if (!row.facts) {
      text += wrapped("  " + left(row.title(), width) + "   " + row.summary, width + 5) + '\n';
      continue;
    }
    const auto& [info, oscillation, decay] = *row.facts;
    text += line(row.title(), info.order > 0 ? std::to_string(info.order) : "-",
                 info.evaluations > 0 ? std::to_string(info.evaluations) : "-",
                 limit_text(oscillation), limit_text(decay), kind_text(info));
  }
  return text +
         "  omega: the largest angular frequency, without drag; lambda: the fastest decay\n"
         "  particles: for q'' = a(t, q) - gamma v only; sim describe NAME: formula, paper\n";
}

std::string json_section(const std::vector<ListRow>& rows, bool scenes) {
  std::vector<std::string> objects;
  for (const ListRow& row : rows) {
    JsonObject object;
    object.text("name", row.name);
    if (!scenes) {
      std::vector<std::string> aliases;
      for (const std::string& alias : row.aliases) aliases.push_back(json_string(alias));
      object.json("aliases", json_array(aliases)).text("summary", row.summary);
      if (row.facts) add_facts(object, *row.facts);
    }
    objects.push_back(object.str());
  }
  return json_array(objects);
}

}  // namespace

std::string plural_kinds() {
  std::vector<std::string> kinds;
  for (const PluginKind& kind : kPluginKinds) kinds.emplace_back(kind.folder);
  return join(kinds, ", ");
}

int list(const ListRequest& request, const Environment& environment, Registry& registry,
         Console& console) {
  if (request.luacats) {
    put(console.out, luacats(environment, registry));
    flush_or_throw(console.out, "standard output");
    return 0;
  }
  if (request.markdown) {
    put(console.out, reference_page(environment, registry));
    flush_or_throw(console.out, "standard output");
    return 0;
  }
  std::vector<std::pair<std::string, std::vector<ListRow>>> sections;
  std::vector<std::string> known{"scenes"};
  const auto add = [&](const std::string& name, auto rows) {
    if (request.what.empty() || request.what == name) sections.emplace_back(name, rows());
  };
  for (const PluginKind& kind : kPluginKinds) {
    known.emplace_back(kind.folder);
    add(known.back(), [&] { return plugin_rows(kind, registry); });
  }
  add("scenes", [&] { return scene_rows(environment); });
  if (sections.empty())
    throw Error(ErrorKind::kUsage,
                {"nothing of that kind to list", "sim list " + request.what,
                 "there are " + plural_kinds() + " and scenes", suggestion(request.what, known)});

  if (request.names) {
    for (const auto& [name, rows] : sections)
      for (const ListRow& row : rows) put(console.out, row.name + "\n");
    flush_or_throw(console.out, "standard output");
    return 0;
  }
  JsonObject object;
  std::string text;
  for (const auto& [name, rows] : sections) {
    object.json(name, json_section(rows, name == "scenes"));
    if (rows.empty() && request.what.empty()) continue;
    text += (text.empty() ? "" : "\n") +
            (name == "integrators" ? integrator_section(rows) : text_section(name, rows));
  }
  put(console.out, request.json ? object.str() + "\n" : text);
  flush_or_throw(console.out, "standard output");
  return 0;
}

}  // namespace sim::cli
