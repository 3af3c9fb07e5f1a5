#include <algorithm>
#include <vector>

#include "core/base/text.h"
#include "core/study/contract/examiner.h"
#include "core/study/study.h"

namespace sim::study::contract {
namespace {

// A weight on a spring, for half a second.
class Pendulum final : public SceneSource {
 public:
  explicit Pendulum(Registry& registry) : registry_(registry) {
    spec_.name = "pendulum";
    spec_.integrator = "rk4";
    spec_.dt = 0.01;
    spec_.duration = 0.5;
    spec_.particles.emplace();
    spec_.particles->list = {{.position = {0, 0, 0}}, {.position = {0.6, -0.8, 0}}};
    spec_.particles->pinned = {0};
    PartSpec spring{"spring", {{"stiffness", 40.0}}};
    spring.elements.add({0, 1}, {{"rest", 1}});
    spec_.forces = {{"gravity", {}}, spring};
  }

  std::string name() const override { return spec_.name; }
  StudiedScene load(const SceneVariant& variant) override {
    StudiedScene scene;
    scene.spec.file = name();
    scene.spec.systems = {spec_};
    for (const std::string& part : variant.without)
      std::erase_if(scene.spec.systems.front().forces,
                    [&](const PartSpec& force) { return force.plugin == part; });
    scene.systems.emplace_back(scene.spec.systems.front(), registry_, options(variant, spec_));
    return scene;
  }
  RunOptions options(const SceneVariant& variant, const SystemSpec&) override {
    return {.integrator = variant.integrator, .dt = variant.dt};
  }
  std::string command(const SceneVariant&) const override { return "sim " + name(); }

 private:
  Registry& registry_;
  SystemSpec spec_;
};

// True for a single JSON object: its braces close with the last character, except for those in
// strings.
bool one_object(const std::string& json) {
  int depth = 0;
  bool text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    if (text && json[i] == '\\') {
      ++i;
    } else if (json[i] == '"') {
      text = !text;
    } else if (!text && json[i] == '{') {
      ++depth;
    } else if (!text && json[i] == '}' && --depth == 0) {
      return i + 1 == json.size() || (i + 2 == json.size() && json.back() == '\n');
    }
    if (depth == 0 && !text) return false;  // it begins with something else
  }
  return false;
}

}  // namespace

void check_study(Registry& registry, const Plugin<Study>& plugin, Contract& contract) {
  Examiner examiner(plugin, contract);
  Pendulum pendulum(registry);
  const bool chooses = std::ranges::count(plugin.takes, "--integrators") > 0;
  const auto found = [&](bool json, const study::Watch& watch) {
    const auto study = made(plugin.make(example_params(plugin)), plugin);
    return study->run(
        {.scene = plugin.takes_scene ? &pendulum : nullptr,
         .registry = &registry,
         .time = 0.1,
         .integrators = chooses ? std::vector<MethodChoice>{"rk4"} : std::vector<MethodChoice>{},
         .json = json,
         .watch = watch,
         .announce = [](double) {}});
  };
  examiner.group("says what it found", [&] {
    const std::string words = found(false, [](std::string_view, double) { return true; });
    examiner.check("says what it found", !words.empty(), std::to_string(words.size()) + " bytes");
  });
  examiner.group("JSON is one object", [&] {
    const std::string json = found(true, [](std::string_view, double) { return true; });
    examiner.check("JSON is one object", one_object(json), std::to_string(json.size()) + " bytes");
  });
  examiner.group("ends when it is told to", [&] {
    constexpr int kPatience = 100;
    int asked = 0;
    found(false, [&](std::string_view, double) { return ++asked < 0; });
    examiner.check("ends when it is told to", asked > 0 && asked <= kPatience,
                   "told " + std::to_string(asked) + " times");
  });
  examiner.bounds([&](const Params& params) {
    made(plugin.make(params), plugin);
    return std::vector<double>{0};
  });
}

}  // namespace sim::study::contract
