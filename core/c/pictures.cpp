// Pictures, and files for other programs.
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "core/base/text.h"
#include "core/c/handles.h"
#include "core/c/pictures.h"
#include "core/c/watcher.h"
#include "core/output/make_writer.h"
#include "core/output/png.h"
#include "core/picture/gallery.h"
#include "core/picture/quantity.h"

using namespace sim;
using namespace sim::c;

struct sim_writer {
  sim_scene* scene;
  std::shared_ptr<Stop> stop = std::make_shared<Stop>();  // of the work at the end
  std::unique_ptr<Writer> writer = nullptr;
};

namespace {

Moment moment_of(const sim_scene& scene) {
  Moment moment;
  for (const Simulation& system : scene.loaded.systems) {
    moment.push_back(take_frame(system));
    if (!system.second_order()) continue;
    const Energy energy = system.energy();
    moment.back().kinetic = energy.kinetic;
    moment.back().potential = energy.potential;
  }
  return moment;
}

std::vector<Model> models_of(sim_scene& scene) {
  std::vector<Model> models;
  for (std::size_t i = 0; i < scene.loaded.systems.size(); ++i)
    models.push_back(make_model(scene.loaded.spec.systems[i], scene.loaded.systems[i]));
  return models;
}

unsigned char* drawn(sim_scene& scene, const LookSpec& asked, size_t& size,
                     sim_watch watch = nullptr, void* user = nullptr) {
  Watcher watcher(watch, user);
  const std::function<bool()> stop = [&] { return watcher.stopped("picture", 0.5); };
  Look look = look_of(scene.loaded.spec, asked);
  const std::vector<Model> models = models_of(scene);
  const Moment moment = moment_of(scene);
  // Quantities of a whole run have no colour here.
  if (quantity(models[0], moment[0], look.colour).empty()) look.colour = "none";
  Gallery gallery(models, {&moment, 1}, look);
  gallery.stop_when(stop);
  const Image& image = gallery.draw(0);
  const std::string bytes = watcher.told() ? "" : png(image, stop);
  if (watcher.told()) throw Stopped();
  auto* const block = static_cast<unsigned char*>(std::malloc(bytes.size()));
  if (!block) throw std::bad_alloc();
  std::memcpy(block, bytes.data(), bytes.size());
  size = bytes.size();
  return block;
}

std::unique_ptr<sim_writer> opened_writer(sim_scene& scene, const std::string& file,
                                          double frames_per_second, const LookSpec& look) {
  FilePlan plan = plan_of(scene);
  std::vector<std::string> names;
  for (const Simulation& system : scene.loaded.systems) names.push_back(system.name());
  for (const std::string& name : written_names(file, names)) plan.writes("the file", name);
  plan.check();
  if (!(std::fabs(frames_per_second) <= 1e6) || (frames_per_second > 0 && frames_per_second < 1e-6))
    refuse("bad value", "frames_per_second " + brief(frames_per_second), "it is out of range",
           "give a number like 30");
  auto writer = std::unique_ptr<sim_writer>(new sim_writer{&scene});
  WriterTask task;
  task.models = models_of(scene);
  task.file = file;
  task.world = scene.loaded.spec.world;
  task.look = look_of(scene.loaded.spec, look);
  task.stop = [stop = writer->stop] { return stop->asked(); };
  if (frames_per_second > 0) task.fps = frames_per_second;
  writer->writer = make_writer(task, *scene.registry);
  return writer;
}

}  // namespace

namespace sim::c {

LookSpec look_spec(const sim_look* given) {
  LookSpec spec;
  if (!given) return spec;
  const sim_look copy = whole_of<sim_look>(*given, "SIM_LOOK"), *const look = &copy;
  if ((look->width != 0) != (look->height != 0))
    refuse("bad value", "width, height", "one of the two is 0", "give both, or none");
  if (look->width != 0)
    spec.size = std::to_string(look->width) + "x" + std::to_string(look->height);
  if (look->color) spec.color = look->color;
  if (look->camera) spec.camera = look->camera;
  for (const char* const* each = look->springs; each && *each; ++each)
    spec.springs.emplace_back(*each);
  spec.wireframe = look->wireframe != 0;
  spec.surface = look->surface != 0;
  for (const char* const* each = look->trails; each && *each; ++each)
    spec.trails.emplace_back(*each);
  return spec;
}

void write_state(sim_scene& scene, const std::string& file) {
  const std::unique_ptr<sim_writer> writer = opened_writer(scene, file, 0, {});
  writer->writer->add(moment_of(scene));
  writer->writer->commit();
}

}  // namespace sim::c

extern "C" {

unsigned char* sim_picture(sim_scene* scene, int width, int height, const char* colour,
                           size_t* size, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    LookSpec asked;
    asked.size = std::to_string(width) + "x" + std::to_string(height);
    if (colour) asked.color = colour;
    return drawn(*scene, asked, checked(size, "size"));
  });
}

unsigned char* sim_draw(sim_scene* scene, const sim_look* look, size_t* size, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    return drawn(*scene, look_spec(look), checked(size, "size"));
  });
}

unsigned char* sim_draw_watched(sim_scene* scene, const sim_look* look, size_t* size,
                                sim_watch watch, void* user, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    return drawn(*scene, look_spec(look), checked(size, "size"), watch, user);
  });
}

sim_writer* sim_writer_open(sim_scene* scene, const char* file, double frames_per_second,
                            sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    return opened_writer(*scene, checked_text(file, "file"), frames_per_second, {}).release();
  });
}

sim_writer* sim_writer_open_look(sim_scene* scene, const char* file, double frames_per_second,
                                 const sim_look* look, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    return opened_writer(*scene, checked_text(file, "file"), frames_per_second, look_spec(look))
        .release();
  });
}

int sim_writer_add(sim_writer* writer, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(checked(writer, "writer").scene);
    writer->writer->add(moment_of(*writer->scene));
  });
}

int sim_writer_commit(sim_writer* writer, sim_error* error) {
  return guarded(error, [&] { checked(writer, "writer").writer->commit(); });
}

int sim_writer_finish(sim_writer* writer, sim_watch watch, void* user, sim_error* error) {
  return guarded(error, [&] {
    checked(writer, "writer");
    Watcher watcher(watch, user);
    const Stop::By asked(*writer->stop, [&] { return watcher.stopped("file", 0.5); });
    writer->writer->commit();
    if (watcher.told()) throw Stopped();
  });
}

void sim_writer_close(sim_writer* writer) { delete writer; }

}  // extern "C"
