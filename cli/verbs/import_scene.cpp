#include "cli/verbs/import_scene.h"

#include "cli/run/environment.h"
#include "core/engine/import_file.h"
#include "core/output/file_plan.h"
#include "core/output/output.h"

namespace sim::cli {

int import_scene(const ImportRequest& request, Console& console) {
  FilePlan plan;
  plan.reads("the mesh", request.mesh);
  if (!request.out.empty()) plan.writes("--out", request.out);
  plan.check();
  Target target;
  if (!request.out.empty()) target.file = request.out;
  Output file(target, console.out);
  engine::import_file(
      {.file = request.mesh,
       .read_h5md = helper_file("read_h5md"),
       .write =
           [&](std::string_view block) {
             file.buffer() += block;
             file.flush_if_full();
           },
       .tell = [&](const std::string& note) { console.err << "sim: " << note << '\n'; }});
  file.commit();
  return 0;
}

}  // namespace sim::cli
