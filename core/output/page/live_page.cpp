#include "core/output/page/live_page.h"

#include <cmath>

#include "core/output/format.h"

namespace sim {
namespace {

std::string json_numbers(const std::vector<double>& values, int digits) {
  std::vector<std::string> texts;
  for (const double value : values)
    texts.push_back(std::isfinite(value) ? brief(value, digits) : "null");
  return json_array(texts);
}

std::string json_ids(const std::vector<int>& ids) {
  std::vector<std::string> texts;
  for (const int id : ids) texts.push_back(std::to_string(id));
  return json_array(texts);
}

// Name, doc, the scene's own value and the present one.
std::string args_json(const std::vector<SceneArg>& args) {
  std::vector<std::string> list;
  const auto put = [](JsonObject& object, const char* key, const Value& value) {
    if (const auto* number = std::get_if<double>(&value))
      object.number(key, *number);
    else if (const auto* flag = std::get_if<bool>(&value))
      object.flag(key, *flag);
    else
      object.text(key, to_text(value));
  };
  for (const SceneArg& arg : args) {
    JsonObject object;
    object.text("name", arg.name).text("doc", arg.doc);
    put(object, "first", arg.default_value);
    put(object, "value", arg.value);
    list.push_back(object.str());
  }
  return json_array(list);
}

std::string system_json(const ViewSystem& system, const std::string& solids, const Frame& frame) {
  JsonObject each;
  each.integer("step", system.now.step).number("t", system.now.t).number("h", system.h);
  each.text("method", system.method).number("share", system.share);
  each.number("kinetic", system.now.kinetic).number("potential", system.now.potential);
  each.number("drift", system.now.drift);
  each.json("pinned", json_ids(system.pinned)).json("held", json_ids(system.held));
  each.text("verdict", system.verdict);
  JsonObject switches;
  for (const auto& [name, on] : system.switches) switches.flag(name, on);
  each.json("switches", switches.str());
  if (!system.hash.empty()) each.text("hash", system.hash);
  each.json("solids", solids);
  if (!frame.torn.empty()) each.json("torn", torn_json(frame));
  return each.str();
}

}  // namespace

LivePage::LivePage(const ViewScene& scene, bool pause_hidden)
    : scene_(scene),
      pause_hidden_(pause_hidden),
      page_(scene_.models, scene_.preview, scene_.look) {}

std::string LivePage::html(const std::string& socket, const std::string& nonce) const {
  std::vector<std::string> methods;
  for (const std::string& name : scene_.methods) methods.push_back(json_string(name));
  JsonObject live;
  live.text("socket", socket).json("methods", json_array(methods));
  live.flag("world", scene_.world).integer("page", scene_.number);
  live.text("colour", scene_.look.colour);
  live.flag("pauseHidden", pause_hidden_).json("args", args_json(scene_.args));
  return page_.of_live(live.str(), nonce);
}

std::string LivePage::frame(const Moment& moment, const ViewState& state) {
  std::vector<std::string> systems;
  for (std::size_t i = 0; i < state.systems.size(); ++i)
    systems.push_back(system_json(state.systems[i], page_.solids(moment, i), moment[i]));
  JsonObject all;
  all.integer("page", state.number).flag("playing", state.playing).number("speed", state.speed);
  all.number("real", state.real).number("us", state.us).flag("slow", state.slow);
  all.number("known", state.known).text("failure", state.failure);
  all.json("systems", json_array(systems));
  if (state.goal.open)
    all.json("goal", JsonObject()
                         .text("asked", state.goal.asked)
                         .flag("busy", state.goal.busy)
                         .text("words", state.goal.words)
                         .str());
  Look look;
  if (!state.measured.empty()) look.colour = state.measured;
  const bool coloured = colour_of(look, scene_.models) != "none";
  ColourScale scale;
  if (coloured) {
    scale = colour_scale(look, scene_.models, {&moment, 1});
    scale.most = most_ = steady_most(scale.most, most_);
    all.json("values", JsonObject()
                           .text("name", state.measured.empty() ? scale.name : state.measured)
                           .text("unit", scale.unit)
                           .number("most", scale.most)
                           .flag("both", scale.both_signs)
                           .str());
  } else {
    most_ = 0;
  }
  return page_.frame(moment, all.str(), coloured ? &scale : nullptr);
}

std::string LivePage::past(std::span<const EnergySample> samples) {
  constexpr std::size_t kMost = 500;
  std::vector<double> t, kinetic, potential;
  const std::size_t every = samples.size() / kMost + 1;
  for (std::size_t i = 0; i < samples.size(); i += every) {
    t.push_back(samples[i].t);
    kinetic.push_back(samples[i].kinetic);
    potential.push_back(samples[i].potential);
  }
  return JsonObject()
      .json("t", json_numbers(t, 7))
      .json("kinetic", json_numbers(kinetic, 5))
      .json("potential", json_numbers(potential, 5))
      .str();
}

}  // namespace sim
