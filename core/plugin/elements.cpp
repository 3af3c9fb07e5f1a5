#include "core/plugin/elements.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/plugin/registry.h"

namespace sim {

std::array<int, 2> GridPairs::range(int axis) const {
  const auto a = static_cast<std::size_t>(axis);
  return {std::max(0, -step[a]), size[a] - std::max(0, step[a])};
}

std::size_t GridPairs::count() const {
  std::size_t product = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [begin, end] = range(axis);
    product *= static_cast<std::size_t>(std::max(end - begin, 0));
  }
  return product;
}

std::size_t Elements::count() const {
  std::size_t sum = listed();
  for (const GridPairs& grid : grids) sum += grid.count();
  return sum;
}

void Elements::add(std::initializer_list<int> particles,
                   const std::map<std::string, double>& given) {
  const std::size_t before = listed();
  ids.insert(ids.end(), particles.begin(), particles.end());
  for (const auto& [name, value] : given) values[name].resize(before, std::nan(""));
  for (auto& [name, column] : values) {
    const auto own = given.find(name);
    column.push_back(own == given.end() ? std::nan("") : own->second);
  }
}

ElementValues::ElementValues(const Elements& elements, const Params& params,
                             const std::string& name) {
  if (const auto own = elements.values.find(name); own != elements.values.end())
    own_ = own->second.data();
  if (params.has(name)) otherwise_ = params.number(name);
}

void check_elements(const Elements& elements, const PluginInfo& plugin, const Params& params,
                    int particles, const SourceLocation& place) {
  if (elements.empty()) return;
  const ElementKind& kind = plugin.elements;
  const std::string owner = plugin.title();
  const auto refuse = [&](const std::string& what, const std::string& why,
                          const std::string& remedy) {
    throw Error(ErrorKind::kScene, {what, place, why, remedy});
  };
  if (kind.arity == 0) refuse(owner, "it takes no ties between particles", "");
  if (!kind.takes(elements.arity) ||
      elements.ids.size() % static_cast<std::size_t>(elements.arity) ||
      (kind.arity != 2 && !elements.grids.empty()))
    refuse(
        owner,
        std::string("a ") + kind.name + " of it joins " + std::to_string(kind.arity) + " particles",
        "");

  // The ids that are joined.
  for (const GridPairs& g : elements.grids)
    if (g.first < 0 || std::ranges::min(g.size) < 0 ||
        g.first + std::int64_t{g.size[0]} * g.size[1] * g.size[2] > particles ||
        g.step == std::array<int, 3>{})
      refuse(owner, "a grid of ties does not fit its particles", "");
  for (std::size_t i = 0; i < elements.ids.size(); ++i) {
    const std::size_t arity = static_cast<std::size_t>(elements.arity), e = i / arity;
    const auto id = elements.ids.begin() + static_cast<std::ptrdiff_t>(i);
    const auto first = elements.ids.begin() + static_cast<std::ptrdiff_t>(e * arity);
    if (*id < 0 || *id >= particles || std::find(first, id, *id) != id)
      refuse(owner,
             std::string(kind.name) + " " + std::to_string(e + 1) +
                 " does not join different particles of the scene",
             "the ids are 0 to " + std::to_string(particles - 1));
  }

  // The values that elements give, and those that the plugin needs.
  for (const auto& [name, column] : elements.values) {
    const auto param = std::ranges::find(plugin.params, name, &Param::name);
    const bool declared = param != plugin.params.end() && param->per_tie;
    if ((!declared && !plugin.free_numbers) || column.size() != elements.listed())
      refuse(owner, std::string("a ") + kind.name + " cannot give '" + name + "' for itself", "");
    for (const double value : column)
      if (const std::string why = std::isnan(value) || !declared ? "" : objection(value, *param);
          !why.empty())
        refuse(owner, name + " of a " + kind.name + " is " + shortest(value), why);
  }
  for (const Param& param : plugin.params) {
    if (!param.per_tie || !param.required || params.has(param.name)) continue;
    const auto own = elements.values.find(param.name);
    if (elements.grids.empty() && own != elements.values.end() &&
        std::ranges::none_of(own->second, [](double value) { return std::isnan(value); }))
      continue;
    refuse("missing '" + param.name + "'",
           owner + " does not give it, nor does every " + kind.name + " of it",
           "give " + param.name + (param.unit.empty() ? "" : " in " + param.unit) +
               " to the force or to the " + kind.name);
  }
}

}  // namespace sim
