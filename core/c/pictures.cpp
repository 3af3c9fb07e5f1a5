// Pictures, and files for other programs.
#include <cstdlib>
#include <cstring>

#include "core/c/handles.h"
#include "core/output/make_writer.h"
#include "core/output/png.h"
#include "core/picture/quantity.h"

using namespace sim;
using namespace sim::c;

struct sim_writer {
  sim_scene* scene;
  std::unique_ptr<Writer> writer;
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

}  // namespace

extern "C" {

unsigned char* sim_picture(sim_scene* scene, int width, int height, const char* colour,
                           size_t* size, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    checked(size, "size");
    LookSpec asked;
    asked.size = std::to_string(width) + "x" + std::to_string(height);
    if (colour) asked.color = colour;
    Look look = look_of(scene->loaded.spec, asked);
    const std::vector<Model> models = models_of(*scene);
    const Moment moment = moment_of(*scene);
    // Quantities of a whole run have no colour here.
    if (quantity(models[0], moment[0], look.colour).empty()) look.colour = "none";
    Gallery gallery(models, {&moment, 1}, look);
    const std::string bytes = png(gallery.draw(0));
    auto* const block = static_cast<unsigned char*>(std::malloc(bytes.size()));
    if (!block) throw std::bad_alloc();
    std::memcpy(block, bytes.data(), bytes.size());
    *size = bytes.size();
    return block;
  });
}

sim_writer* sim_writer_open(sim_scene* scene, const char* file, double frames_per_second,
                            sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    WriterTask task;
    task.models = models_of(*scene);
    task.file = checked_text(file, "file");
    task.world = scene->loaded.spec.world;
    task.look = look_of(scene->loaded.spec, {});
    if (frames_per_second > 0) task.fps = frames_per_second;
    auto writer = std::make_unique<sim_writer>();
    writer->scene = scene;
    writer->writer = make_writer(task, *scene->registry);
    return writer.release();
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

void sim_writer_close(sim_writer* writer) { delete writer; }

}  // extern "C"
