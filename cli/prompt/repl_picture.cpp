// The scene as it is now, drawn into the terminal or a file.
#include <algorithm>

#include "cli/prompt/repl_actions.h"
#include "cli/run/recorder.h"
#include "cli/terminal/cells.h"
#include "core/base/error.h"
#include "core/output/writer.h"
#include "core/picture/scenery.h"

namespace sim::cli::actions {
namespace {

// A picture of 16 by 9 that leaves room for a prompt.
std::string in_cells(std::span<const Model> models, const Moment& moment, sim::Look look) {
  const CellSize size = terminal_size();
  const int columns = std::clamp(size.columns, 16, 160),
            rows = std::clamp(columns * 9 / 32, 8, std::max(8, size.rows - 3));
  look.width = columns;
  look.height = 2 * rows;
  Picture picture = Scenery(models, {&moment, 1}, look).picture(0);
  picture.texts.clear();  // too small to read
  Raster raster(look.width, look.height);
  const Image& image = raster.draw(picture);
  const Cells cells;
  std::string text;
  for (int y = 0; y < rows; ++y) text += cells.row(image, y) + '\n';
  return text;
}

}  // namespace

Answer show(Call& call) {
  call.take(0, 1);
  LoadedScene& scene = call.session.live().loaded();
  WriterTask task;
  Moment moment;
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    task.models.push_back(make_model(scene.spec.systems[i], scene.systems[i]));
    moment.push_back(take_frame(scene.systems[i]));
  }
  task.world = scene.spec.world;
  task.look = look_of(scene.spec, {});
  // A colour that needs a whole run is not available here.
  if (quantity(task.models[0], moment[0], task.look.colour).empty()) task.look.colour = "none";
  if (call.count() == 0) {
    if (const std::string why = no_pictures(); !why.empty())
      throw Error(ErrorKind::kUsage, {"no picture", ".show", why, "give a file: .show now.png"});
    return words(in_cells(task.models, moment, task.look));
  }
  task.file = call.text(0, "a file");
  OutRequest request;
  request.files = {task.file};
  check_files(request, call.session.registry());
  for (const std::string& name : written_names(task.file, scene.names()))
    call.session.check_output(".show", name);
  const std::unique_ptr<Writer> writer = make_writer(task, call.session.registry());
  writer->add(moment);
  writer->commit();
  return {};
}

}  // namespace sim::cli::actions
