#include "core/plugin/method.h"

#include <algorithm>

#include "core/plugin/registry.h"

namespace sim {

MethodChoice MethodChoice::over(const MethodChoice& own) const {
  if (!name.empty()) return *this;
  MethodChoice choice(own.name, given);
  choice.given.insert(own.given.begin(), own.given.end());
  return choice;
}

bool operator==(const MethodChoice& a, const MethodChoice& b) {
  return a.name == b.name && std::ranges::equal(a.given, b.given, [](const auto& l, const auto& r) {
           return l.first == r.first && to_text(l.second) == to_text(r.second);
         });
}

Method::Method(Registry& registry, const MethodChoice& choice, const SourceLocation& place)
    : Method(registry, registry.get<Integrator>(choice.name, place), choice.given, place) {}

Method::Method(Registry& registry, const IntegratorPlugin& plugin,
               std::map<std::string, Value> given, const SourceLocation& place)
    : registry_(&registry),
      plugin_(&plugin),
      choice_(plugin.name, std::move(given)),
      params_(plugin.title(), plugin.params, choice_.given, place) {}

std::string Method::label() const {
  std::string text = plugin_->name;
  for (const Param& param : plugin_->params) {
    const std::string value = to_text(params_.value(param.name));
    if (value == to_text(param.default_value)) continue;
    text += (text == plugin_->name ? ":" : ",") + param.name + "=" + value;
  }
  return text;
}

std::unique_ptr<Integrator> Method::make() const {
  if (!plugin_->make_from_others) return made(plugin_->make(params_), *plugin_);
  const auto other = [registry = registry_](const MethodChoice& choice) {
    return Method(*registry, choice).make();
  };
  return made(plugin_->make_from_others(params_, other), *plugin_);
}

}  // namespace sim
