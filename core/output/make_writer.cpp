#include "core/output/make_writer.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim {

const Plugin<Writer>& writer_of(const std::string& file, Registry& registry) {
  const std::string ending = ending_of(file);
  if (const PluginInfo* found = ending.empty() ? nullptr : registry.find(kind_of<Writer>, ending))
    return static_cast<const Plugin<Writer>&>(*found);
  std::vector<std::string> known;
  for (const std::string& name : registry.names<Writer>()) {
    known.push_back("." + name);
    for (const std::string& alias : registry.find(kind_of<Writer>, name)->aliases)
      known.push_back("." + alias);
  }
  if (ending == "svg")
    throw Error(ErrorKind::kUsage,
                {"a chart is not a picture of the scene", "--out " + file, "--out draws no .svg",
                 "--energy=" + file +
                     " draws energies, sim tradeoff --svg error against cost, sim "
                     "plot a table, .plot at the prompt what it recorded; a picture is .png"});
  throw Error(ErrorKind::kUsage,
              {"unknown ending of a file", "--out " + file,
               ending.empty()    ? "its name has none"
               : is_hdf5(ending) ? "this build has no HDF5; install libhdf5-dev and build again"
                                 : "nothing writes ." + ending,
               "known: " + join(known, ", ") + "; a plugin of the kind writer may bring others"});
}

std::unique_ptr<Writer> make_writer(WriterTask task, Registry& registry) {
  const Plugin<Writer>& plugin = writer_of(task.file, registry);
  task.format = ending_of(task.file);
  return made(plugin.make(Params(plugin.title(), plugin.params, {}, ""), task), plugin);
}

Look look_of(const SceneSpec& scene, const LookSpec& asked) {
  const auto own = std::ranges::find_if(
      scene.systems, [](const SystemSpec& system) { return !system.look.empty(); });
  return make_look(own != scene.systems.end() ? own->look : LookSpec{}, asked,
                   names_of_fields(scene));
}

}  // namespace sim
