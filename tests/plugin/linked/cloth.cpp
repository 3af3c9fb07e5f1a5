// A program that is linked with its plugins and opens no library for them: the default cloth, whose
// hash it prints. `sim_linked SCRIPTS PLUGINS`: where scenes and libraries are.
#include <cstdio>
#include <cstdlib>

#include "core/lua/scene/scene_file.h"
#include "core/plugin/linked_plugins.h"
#include "core/scene/simulation.h"

namespace {

int failures = 0;

void check(bool truth, const char* what) {
  if (truth) return;
  ++failures;
  std::printf("not true: %s\n", what);
}

template <class Action>
std::string why_refused(Action action) {
  try {
    action();
  } catch (const sim::Error& error) {
    return error.text().why;
  }
  return "";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  sim::Registry plugins({}, {}, false, sim::linked_plugins());
  check(sim::linked_plugins().size() == 4, "four plugins are linked in");
  check(plugins.names<sim::Force>() == std::vector<std::string>{"drag", "gravity", "spring"},
        "the names of the forces are known");
  check(plugins.get<sim::Integrator>("rk4").file == "the program", "they say where they are");
  check(plugins.find(sim::kind_of<sim::Integrator>, "r") ==
            plugins.find(sim::kind_of<sim::Integrator>, "rk4"),
        "aliases are known");
  check(plugins.libraries().empty() && plugins.inputs().empty(), "they have no files");
  check(why_refused([&] { plugins.get<sim::Force>("wind"); }) == "no plugin has that name",
        "others are unknown");

  // A library beside them may have other names, not the same.
  const std::string taken =
      why_refused([&] { sim::Registry({argv[2]}, {}, false, sim::linked_plugins()); });
  check(taken.ends_with("is taken by the program"), "one name is that of one plugin");

  sim::SceneOptions options;
  options.search_path = {argv[1]};
  const sim::SceneSpec scene = sim::load_scene("scenes/cloth.lua", plugins, options);
  sim::Simulation cloth(scene.systems.front(), plugins);
  while (cloth.t() < 2 && cloth.step()) {}
  std::printf("%016llx\n", static_cast<unsigned long long>(cloth.hash()));
  check(cloth.hash() == 0x129f25ebe3e79c14, "the bits are those of plugins that are opened");
  return failures == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
