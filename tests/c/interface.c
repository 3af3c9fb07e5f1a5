/* A program in C99 over sim.h: a cloth with its known hash, a judged run, every call once, and what a
 * hostile or careless caller does. `interface FOLDER`: where files may be made. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <pthread.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sim.h"

static int passed = 0, failed = 0;

#define CHECK(truth)                                                   \
  do {                                                                 \
    if (truth) {                                                       \
      ++passed;                                                        \
    } else {                                                           \
      ++failed;                                                        \
      printf("%s:%d: not true: %s\n", __FILE__, __LINE__, #truth);     \
    }                                                                  \
  } while (0)

#define CLOTH_HASH UINT64_C(0x129f25ebe3e79c14)

static void tell(const sim_error* error) {
  printf("%d: %s: %s: %s; %s\n", error->code, error->what, error->where, error->why,
         error->remedy);
}

static double number_in(const char* json, const char* name);

static sim_scene* open_or_tell(const char* name, const sim_options* options) {
  sim_error error;
  sim_scene* scene = sim_open(name, options, &error);
  if (!scene) tell(&error);
  return scene;
}

/* The layouts that programs of 1.0 were compiled with, where pointers have 8 bytes. */
static void structures_are_those_of_1_0(void) {
  if (sizeof(void*) != 8) return;
  CHECK(sizeof(sim_error) == 3076 && offsetof(sim_error, remedy) == 2052);
  CHECK(offsetof(sim_options, lua_budget) == 80 && offsetof(sim_options, dt) == 56);
  CHECK(offsetof(sim_options, safe) == 68 && offsetof(sim_options, seed) == 72);
  CHECK(sizeof(sim_part) == 48 && offsetof(sim_part, generation) == 40);
  CHECK(sizeof(sim_energies) == 16 && sizeof(sim_spring) == 104);
  CHECK(offsetof(sim_spring, family) == 40);
  CHECK(sizeof(sim_verdict) == 72 && offsetof(sim_verdict, horizon) == 56);
}

static void steps_have_the_known_bits(void) {
  sim_scene* cloth = open_or_tell("scenes/cloth.lua", NULL);
  sim_part part;
  double* copy;
  int64_t taken = 0;
  uint64_t before = sim_generation(cloth);
  int i;
  CHECK(cloth != NULL);
  CHECK(sim_systems(cloth) == 1);
  CHECK(sim_step(cloth, 400, &taken, NULL) == SIM_OK);
  CHECK(taken == 400);
  CHECK(sim_step_count(cloth, 0) == 400);
  CHECK(fabs(sim_time(cloth, 0) - 400 * sim_step_size(cloth, 0)) < 1e-12);
  CHECK(sim_hash(cloth, 0) == CLOTH_HASH);
  CHECK(sim_generation(cloth) != before);
  CHECK(sim_state(cloth, 0, "position", &part, NULL) == SIM_OK);
  CHECK(part.count == 64 && part.components == 3);
  CHECK(part.generation == sim_generation(cloth));
  copy = malloc(part.count * part.components * sizeof *copy);
  CHECK(sim_copy_state(cloth, 0, "position", copy, part.count * part.components, NULL) == SIM_OK);
  for (i = 0; i < 3 * 64; ++i)
    if (copy[i] != part.data[(size_t)(i / 3) * part.item_stride +
                             (size_t)(i % 3) * part.component_stride])
      break;
  CHECK(i == 3 * 64);
  CHECK(sim_copy_state(cloth, 0, "position", copy, 3, NULL) == SIM_USAGE);
  free(copy);
  sim_close(cloth);
}

/* x' = x^2 by Euler's rule: x + h x^2, from 1, until it is not finite. */
static int steps_of_blow_up(double h, double* last) {
  double x = 1;
  int count = 0;
  while (isfinite(x + h * x * x)) {
    x += h * x * x;
    ++count;
  }
  *last = x;
  return count;
}

/* Steps that were taken are counted, whether all were or not; a reset takes back all of them. */
static void steps_are_counted(void) {
  static const char text[] =
      "local sim = require 'sim'\n"
      "return sim.scene { state = {1}, field = sim.field.formula { 'u^2', names = {'u'} },\n"
      "  integrator = 'euler', dt = 0.125, duration = 1 }\n";
  sim_scene* scene = sim_open_text(text, "blow.lua", NULL, NULL);
  sim_scene* world = open_or_tell("scenes/sample.lua", NULL);
  sim_error error;
  double last, x;
  const int most = steps_of_blow_up(0.125, &last);
  int64_t taken = -7, all = 0;
  uint64_t start = sim_hash(scene, 0), before;
  int steps, i;
  CHECK(scene != NULL && most > 8 && most < 40);
  CHECK(sim_step(NULL, 5, &taken, NULL) == SIM_USAGE && taken == 0);
  taken = -7;
  CHECK(sim_step(scene, -1, &taken, &error) == SIM_USAGE && taken == 0 && sim_time(scene, 0) == 0);
  for (steps = 0; steps <= most + 2; ++steps) {
    taken = -7;
    before = sim_generation(scene);
    CHECK(sim_step(scene, steps, &taken, &error) == (steps > most ? SIM_DIVERGED : SIM_OK));
    CHECK(taken == (steps > most ? most : steps) && sim_step_count(scene, 0) == taken);
    CHECK(sim_time(scene, 0) == 0.125 * (double)taken);
    CHECK(sim_generation(scene) != before && (sim_hash(scene, 0) == start) == (taken == 0));
    for (i = 0, x = 1; i < taken; ++i) x += 0.125 * x * x;
    CHECK(sim_copy_state(scene, 0, "component", &last, 1, NULL) == SIM_OK && last == x);
    before = sim_generation(scene);
    CHECK(sim_reset(scene, NULL) == SIM_OK && sim_generation(scene) != before);
    CHECK(sim_step_count(scene, 0) == 0 && sim_time(scene, 0) == 0);
    CHECK(sim_hash(scene, 0) == start);
  }
  /* Of a world each system takes so many steps, and each is reset. */
  CHECK(sim_systems(world) == 3);
  for (steps = 1; steps <= 40; steps += 13) {
    taken = -7;
    CHECK(sim_step(world, steps, &taken, NULL) == SIM_OK && taken == steps);
    all += steps;
    for (i = 0; i < 3; ++i) CHECK(sim_step_count(world, i) == all);
  }
  CHECK(sim_reset(world, NULL) == SIM_OK);
  for (i = 0; i < 3; ++i) CHECK(sim_step_count(world, i) == 0 && sim_time(world, i) == 0);
  sim_close(world);
  sim_close(scene);
}

/* Options of programs that were compiled with an older or a newer header, with what lies behind. */
static void options_of_other_versions_are_read(void) {
  struct {
    sim_options options;
    uint64_t later[2];
  } more = {SIM_OPTIONS, {0, 0}};
  sim_options options = SIM_OPTIONS;
  sim_error error;
  sim_scene* cloth;
  size_t size;
  /* A smaller structure: what it does not have is as if nobody had asked, whatever lies there. */
  memset(&options, 0xff, sizeof options);
  options.size = sizeof options.size;
  cloth = open_or_tell("scenes/cloth.lua", &options);
  CHECK(cloth && sim_step(cloth, 400, NULL, NULL) == SIM_OK);
  CHECK(sim_hash(cloth, 0) == CLOTH_HASH);
  sim_close(cloth);
  options.size = offsetof(sim_options, dt);
  options.settings = options.off = options.without = options.folders = options.libraries = NULL;
  options.integrator = "verlet";
  cloth = open_or_tell("scenes/cloth.lua", &options);
  CHECK(cloth && sim_step_size(cloth, 0) == 0.005);
  sim_close(cloth);
  /* A larger one, where the new members are not used; then one that is. */
  more.options.size = sizeof more;
  more.options.dt = 0.001;
  cloth = open_or_tell("scenes/cloth.lua", &more.options);
  CHECK(cloth && sim_step_size(cloth, 0) == 0.001);
  sim_close(cloth);
  more.later[1] = 1;
  CHECK(sim_open("scenes/cloth.lua", &more.options, &error) == NULL && error.code == SIM_USAGE);
  CHECK(strcmp(error.what, "unknown option") == 0 && error.where[0] && error.why[0] &&
        error.remedy[0]);
  /* Sizes of no version, which are not believed. */
  for (size = 0; size < sizeof options.size; ++size) {
    more.options.size = size;
    CHECK(sim_open("scenes/cloth.lua", &more.options, NULL) == NULL);
  }
  more.options.size = sizeof options - 3;
  CHECK(sim_open("scenes/cloth.lua", &more.options, NULL) == NULL);
  more.options.size = (size_t)-8;
  CHECK(sim_open("scenes/cloth.lua", &more.options, NULL) == NULL);
}

struct watched {
  int calls, stop_at;
};

static int watch(void* user, const char* what, double done) {
  struct watched* seen = user;
  if (!what || !(done >= 0 && done <= 1)) seen->calls += 1000000;
  return ++seen->calls == seen->stop_at;
}

static void runs_are_judged(void) {
  struct watched seen = {0, 0};
  sim_scene* cloth = open_or_tell("scenes/cloth.lua", NULL);
  sim_verdict verdict;
  char* json;
  CHECK(sim_judge(cloth, 0, &verdict, NULL) == SIM_USAGE);
  CHECK(sim_run(cloth, 0, 2, watch, &seen, NULL) == SIM_OK);
  CHECK(seen.calls >= 1 && seen.calls < 1000000);
  CHECK(sim_hash(cloth, 0) == CLOTH_HASH);
  CHECK(sim_judge(cloth, 0, &verdict, NULL) == SIM_OK);
  CHECK(strcmp(sim_trust_name(verdict.trust), "trusted") == 0);
  CHECK(verdict.position_error > 0 && verdict.position_error < 0.02);
  CHECK(verdict.dt_share > 0 && verdict.dt_share < 1);
  json = sim_verdict_json(cloth, NULL);
  CHECK(json && strstr(json, "\"hash\":\"129f25ebe3e79c14\"") && strstr(json, "\"trusted\""));
  sim_free(json);

  /* A stop at the first question; the handle goes on. */
  seen.calls = 0;
  seen.stop_at = 1;
  CHECK(sim_reset(cloth, NULL) == SIM_OK);
  CHECK(sim_run(cloth, 1.0, 1, watch, &seen, NULL) == SIM_STOPPED);
  CHECK(sim_judge(cloth, 0, &verdict, NULL) == SIM_OK && verdict.trust == 3);
  CHECK(sim_reset(cloth, NULL) == SIM_OK);
  CHECK(sim_run(cloth, 0, 0, NULL, NULL, NULL) == SIM_OK);
  CHECK(sim_hash(cloth, 0) == CLOTH_HASH);
  CHECK(sim_judge(cloth, 0, &verdict, NULL) == SIM_OK && verdict.trust == 1);
  sim_close(cloth);
}

/* Steps that are ended from outside leave the last whole state, from which the same bits follow. */
static void steps_are_ended(void) {
  static const char* const settings[] = {"n=300", NULL};
  struct watched seen = {0, 1};
  sim_options options = SIM_OPTIONS;
  sim_scene *cloth, *whole;
  sim_error error;
  int64_t taken = -1, all = 0;
  int i;
  options.settings = settings;
  options.dt = 1e-4;
  cloth = open_or_tell("scenes/cloth.lua", &options);
  whole = open_or_tell("scenes/cloth.lua", &options);
  CHECK(sim_step_watched(cloth, 1000000, &taken, watch, &seen, &error) == SIM_STOPPED);
  CHECK(seen.calls == 1 && taken >= 0 && taken < 1000000 && error.code == SIM_STOPPED);
  CHECK(sim_step_count(cloth, 0) == taken);
  all = taken;
  for (i = 0; i < 20; ++i) {
    CHECK(sim_step_for(cloth, 1000000, 0.001 * (double)i, &taken, NULL) == SIM_STOPPED);
    CHECK(taken >= 0 && taken < 1000000);
    all += taken;
  }
  CHECK(sim_step_count(cloth, 0) == all);
  CHECK(sim_step(whole, all, NULL, NULL) == SIM_OK);
  CHECK(sim_hash(whole, 0) == sim_hash(cloth, 0));
  CHECK(sim_step_for(cloth, 1, NAN, NULL, NULL) == SIM_USAGE);
  CHECK(sim_step_for(cloth, -1, 1, NULL, NULL) == SIM_USAGE);
  CHECK(sim_step_watched(cloth, -1, NULL, NULL, NULL, NULL) == SIM_USAGE);
  CHECK(sim_step_watched(cloth, 1, &taken, NULL, NULL, NULL) == SIM_OK && taken == 1);
  CHECK(sim_step_for(cloth, 3, INFINITY, &taken, NULL) == SIM_OK && taken == 3);
  sim_close(cloth);
  sim_close(whole);
  /* A world: its systems stay together. */
  cloth = open_or_tell("scenes/sample.lua", NULL);
  CHECK(sim_step_for(cloth, 40, INFINITY, &taken, NULL) == SIM_OK && taken == 40);
  CHECK(sim_step_for(cloth, INT64_MAX, 0.02, &taken, NULL) == SIM_STOPPED && taken > 0);
  for (i = 0; i < sim_systems(cloth); ++i) CHECK(sim_step_count(cloth, i) == 40 + taken);
  sim_close(cloth);
}

/* A force of the scene that does not come to its end is ended, too. */
static void functions_of_scenes_are_ended(void) {
  static const char* const endless =
      "local sim = require 'sim' local p = sim.particles() p:add {0, 0, 0}\n"
      "local f = sim.force.lua { f = function(t) while t > 0.05 do end return 0, 0, 0 end }\n"
      "return sim.scene { particles = p, forces = { f }, integrator = 'euler', dt = 0.01,\n"
      "  duration = 1 }";
  struct watched seen = {0, 1};
  sim_scene* scene = sim_open_text(endless, "endless.lua", NULL, NULL);
  sim_error error;
  int64_t taken = 0;
  CHECK(scene != NULL);
  CHECK(sim_step_watched(scene, 100, &taken, watch, &seen, &error) == SIM_STOPPED && taken == 6);
  CHECK(sim_step_for(scene, 100, 0.1, &taken, &error) == SIM_STOPPED && taken == 0);
  CHECK(fabs(sim_time(scene, 0) - 0.06) < 1e-12);
  seen.calls = 0;
  seen.stop_at = 3;
  CHECK(sim_run(scene, 1, 0, watch, &seen, &error) == SIM_STOPPED);
  CHECK(fabs(sim_time(scene, 0) - 0.06) < 1e-12);
  sim_close(scene);
}

static void checkpoints_are_gone_on_from(const char* folder) {
  sim_scene *cloth = open_or_tell("scenes/cloth.lua", NULL), *other;
  sim_error error;
  sim_verdict verdict;
  char file[512], *json;
  FILE* bad;
  snprintf(file, sizeof file, "%s/cloth.snap", folder);
  CHECK(sim_step(cloth, 100, NULL, NULL) == SIM_OK && sim_save(cloth, file, NULL) == SIM_OK);
  CHECK(sim_reset(cloth, NULL) == SIM_OK && sim_resume(cloth, file, NULL) == SIM_OK);
  CHECK(sim_step_count(cloth, 0) == 100);
  CHECK(sim_run(cloth, 1.5, 0, NULL, NULL, NULL) == SIM_OK);
  CHECK(sim_hash(cloth, 0) == CLOTH_HASH);
  other = sim_open_saved(file, NULL, &error);
  CHECK(other && sim_step(other, 300, NULL, NULL) == SIM_OK && sim_hash(other, 0) == CLOTH_HASH);
  sim_close(other);
  /* The books of a run go on, as with --snap and --resume. */
  CHECK(sim_reset(cloth, NULL) == SIM_OK && sim_run(cloth, 0.5, 0, NULL, NULL, NULL) == SIM_OK);
  json = sim_verdict_json(cloth, NULL);
  CHECK(sim_save(cloth, file, NULL) == SIM_OK);
  other = sim_open_saved(file, NULL, &error);
  CHECK(other && sim_run(other, 1.5, 0, NULL, NULL, NULL) == SIM_OK);
  CHECK(sim_hash(other, 0) == CLOTH_HASH);
  CHECK(sim_judge(other, 0, &verdict, NULL) == SIM_OK && verdict.trust == 1);
  {
    char* later = sim_verdict_json(other, NULL);
    CHECK(number_in(strstr(json, "\"energy\""), "start") ==
          number_in(strstr(later, "\"energy\""), "start"));
    sim_free(later);
  }
  sim_free(json);
  sim_close(other);
  other = open_or_tell("scenes/pendulum.lua", NULL);
  CHECK(sim_resume(other, file, &error) == SIM_CHECKPOINT && error.why[0] && error.remedy[0]);
  CHECK(sim_resume(other, "no/such/file", &error) == SIM_IO);
  CHECK(sim_save(other, "/no/such/folder/x", &error) == SIM_IO);
  CHECK(sim_save(other, "-", &error) == SIM_USAGE && sim_save(other, "", NULL) == SIM_USAGE);
  CHECK(sim_save(NULL, file, NULL) == SIM_USAGE && sim_save(other, NULL, NULL) == SIM_USAGE);
  CHECK(sim_resume(NULL, file, NULL) == SIM_USAGE && sim_resume(other, NULL, NULL) == SIM_USAGE);
  CHECK(sim_open_saved(NULL, NULL, NULL) == NULL);
  bad = fopen(file, "r+b");
  if (bad) {
    fseek(bad, 200, SEEK_SET);
    fputc(7, bad);
    fclose(bad);
  }
  CHECK(sim_open_saved(file, NULL, &error) == NULL && error.code == SIM_CHECKPOINT);
  remove(file);
  sim_close(other);
  sim_close(cloth);
}

static void runs_are_asked_for_figures(void) {
  static const char* const figures[] = {"mean sag", NULL};
  static const char* const moments[] = {"sag", NULL};
  sim_scene* scene = open_or_tell("scenes/pendulum.lua", NULL);
  sim_error error;
  char* json;
  CHECK(sim_check(scene, "energy=1%", &error) == SIM_USAGE);
  CHECK(sim_judge_figures(scene, moments, &error) == SIM_USAGE && strstr(error.remedy, "mean sag"));
  CHECK(sim_judge_figures(scene, figures, NULL) == SIM_OK);
  CHECK(sim_run(scene, 1, 2, NULL, NULL, NULL) == SIM_OK);
  json = sim_verdict_json(scene, NULL);
  CHECK(json && strstr(json, "\"mean sag\""));
  sim_free(json);
  CHECK(sim_check(scene, "verified,energy=50%", &error) == SIM_OK);
  CHECK(sim_check(scene, "energy=0", &error) == SIM_CHECK && error.why[0] && error.remedy[0]);
  CHECK(sim_check(scene, "nonsense", &error) == SIM_USAGE);
  json = sim_come_to_rest(scene, NULL, NULL, &error);
  CHECK(json && number_in(json, "force") < 1e-6 * number_in(json, "in_play"));
  sim_free(json);
  sim_close(scene);
  scene = open_or_tell("scenes/rope.lua", NULL);
  CHECK(sim_step(scene, 3, NULL, NULL) == SIM_OK);
  json = sim_tensions(scene, 0, &error);
  CHECK(json && strstr(json, "\"tension\"") && number_in(json, "b") == 1);
  sim_free(json);
  sim_close(scene);
  scene = open_or_tell("scenes/cloth.lua", NULL);
  json = sim_tensions(scene, 0, NULL);
  CHECK(json && strcmp(json, "[]") == 0);
  sim_free(json);
  CHECK(sim_tensions(scene, 1, NULL) == NULL && sim_tensions(NULL, 0, NULL) == NULL);
  sim_close(scene);
  scene = open_or_tell("scenes/circle.lua", NULL);
  CHECK(sim_come_to_rest(scene, NULL, NULL, &error) == NULL && error.code == SIM_USAGE);
  CHECK(sim_step(scene, 1, NULL, NULL) == SIM_OK);
  sim_close(scene);
}

/* Looks of pictures, as the options of the command line. */
/* True for two files of a folder that are there and have other bytes. */
static int files_differ(const char* folder, const char* one, const char* other) {
  char name[600];
  FILE *a, *b;
  int x = 0, y = 0, differ = 0;
  snprintf(name, sizeof name, "%s/%s", folder, one);
  a = fopen(name, "rb");
  snprintf(name, sizeof name, "%s/%s", folder, other);
  b = fopen(name, "rb");
  while (a && b && x != EOF && y != EOF && !differ) differ = (x = getc(a)) != (y = getc(b));
  if (a) fclose(a);
  if (b) fclose(b);
  return differ;
}

static void pictures_have_looks(const char* folder) {
  static const char* const trails[] = {"40", NULL};
  static const char* const bad_trails[] = {"4000", NULL};
  int i, k, ended[3];
  static const char* const springs[] = {"12", "shear", NULL};
  static const char* const bad_springs[] = {"nonsense", NULL};
  sim_scene* cloth = open_or_tell("scenes/cloth.lua", NULL);
  sim_look look = SIM_LOOK;
  sim_error error;
  size_t size = 0, other = 0;
  unsigned char *png, *plain;
  char file[512];
  sim_writer* writer;
  struct watched seen = {0, 1};
  look.width = 64, look.height = 48;
  plain = sim_draw(cloth, &look, &size, &error);
  CHECK(plain && memcmp(plain, "\x89PNG", 4) == 0);
  look.camera = "eye=3,1,2 at=0.5,0,0.5 fov=25";
  look.springs = springs;
  look.wireframe = 1;
  look.color = "speed:2";
  png = sim_draw(cloth, &look, &other, &error);
  CHECK(png && (size != other || memcmp(png, plain, size) != 0));
  sim_free(png);
  sim_free(plain);
  look.springs = bad_springs;
  png = sim_draw(cloth, &look, &other, &error);
  CHECK(png == NULL && error.code == SIM_USAGE);
  look.springs = NULL;
  look.camera = "eye=1,2";
  CHECK(sim_draw(cloth, &look, &other, &error) == NULL && error.code == SIM_USAGE);
  look.camera = NULL;
  look.height = 0;
  CHECK(sim_draw(cloth, &look, &other, NULL) == NULL);
  look.height = -48;
  CHECK(sim_draw(cloth, &look, &other, NULL) == NULL);
  look.height = 48;
  look.size = 3;
  CHECK(sim_draw(cloth, &look, &other, NULL) == NULL);
  look.size = sizeof look;
  CHECK(sim_draw(cloth, &look, NULL, NULL) == NULL && sim_draw(NULL, &look, &size, NULL) == NULL);
  png = sim_draw(cloth, NULL, &size, NULL);
  CHECK(png != NULL);
  sim_free(png);
  snprintf(file, sizeof file, "%s/look.png", folder);
  writer = sim_writer_open_look(cloth, file, 30, &look, &error);
  CHECK(writer && sim_writer_add(writer, NULL) == SIM_OK);
  CHECK(sim_writer_finish(writer, NULL, NULL, &error) == SIM_OK && remove(file) == 0);
  sim_writer_close(writer);
  snprintf(file, sizeof file, "%s/look-%%d.png", folder);
  writer = sim_writer_open_look(cloth, file, 30, &look, &error);
  CHECK(writer && sim_writer_add(writer, NULL) == SIM_OK);
  CHECK(sim_writer_finish(writer, watch, &seen, &error) == SIM_STOPPED && seen.calls == 1);
  sim_writer_close(writer);
  CHECK(sim_writer_open_look(cloth, file, 1e300, NULL, NULL) == NULL);
  /* A trail goes through the moments of the file. */
  for (i = 0; i < 3; ++i) {
    snprintf(file, sizeof file, "%s/trail%d.png", folder, i);
    look.trails = i == 0 ? NULL : i == 1 ? trails : bad_trails;
    CHECK(sim_reset(cloth, NULL) == SIM_OK);
    writer = sim_writer_open_look(cloth, file, 30, &look, &error);
    for (k = 0; writer && k < 4; ++k)
      if (sim_writer_add(writer, &error) != SIM_OK || sim_step(cloth, 30, NULL, NULL) != SIM_OK) break;
    ended[i] = writer && k == 4 ? sim_writer_finish(writer, NULL, NULL, &error) : SIM_USAGE;
    sim_writer_close(writer);
  }
  CHECK(ended[0] == SIM_OK && ended[1] == SIM_OK && ended[2] != SIM_OK && error.what[0]);
  CHECK(files_differ(folder, "trail0.png", "trail1.png"));
  CHECK(sim_writer_finish(NULL, NULL, NULL, NULL) == SIM_USAGE);
  sim_close(cloth);
}

static void changes_are_made_and_undone(void) {
  static const double x[3] = {0.5, 0.25, 0.125}, bad[3] = {0, HUGE_VAL, 0};
  sim_scene* cloth = open_or_tell("scenes/cloth.lua", NULL);
  sim_error error;
  sim_energies energies;
  sim_spring springs[2];
  size_t count = 0;
  double now[3 * 64];
  uint64_t hash = sim_hash(cloth, 0);
  sim_snapshot* snapshot = sim_snapshot_take(cloth, NULL);
  sim_scene* other = open_or_tell("scenes/cloth.lua", NULL);
  CHECK(sim_set_position(cloth, 0, 12, x, NULL) == SIM_OK);
  CHECK(sim_copy_state(cloth, 0, "position", now, 3 * 64, NULL) == SIM_OK);
  CHECK(now[36] == 0.5 && now[37] == 0.25 && now[38] == 0.125);
  CHECK(sim_set_position(cloth, 0, 12, bad, &error) == SIM_USAGE);
  CHECK(error.code == SIM_USAGE && error.what[0]);
  CHECK(sim_set_position(cloth, 0, 64, x, NULL) == SIM_USAGE);
  CHECK(sim_set_position(cloth, 0, -1, x, NULL) == SIM_USAGE);
  CHECK(sim_set_position(cloth, 1, 0, x, NULL) == SIM_USAGE);
  CHECK(sim_set_position(cloth, 0, 12, NULL, NULL) == SIM_USAGE);
  CHECK(sim_set_velocity(cloth, 0, 12, x, NULL) == SIM_OK);
  CHECK(sim_set_pinned(cloth, 0, 12, 1, NULL) == SIM_OK);
  CHECK(sim_set_dt(cloth, 0, -1, NULL) == SIM_USAGE);
  CHECK(sim_set_dt(cloth, 0, 0.001, NULL) == SIM_OK);
  CHECK(sim_step_size(cloth, 0) == 0.001);
  CHECK(sim_set_integrator(cloth, 0, "rk44", &error) == SIM_USAGE);
  CHECK(strstr(error.remedy, "rk4") != NULL);
  CHECK(sim_set_integrator(cloth, 0, "rk4", NULL) == SIM_OK);
  CHECK(sim_set_switch(cloth, 0, "nothing", 0, NULL) == SIM_USAGE);
  CHECK(sim_step(cloth, 3, NULL, NULL) == SIM_OK);
  CHECK(sim_hash(cloth, 0) != hash);
  CHECK(sim_snapshot_restore(other, snapshot, NULL) == SIM_USAGE);
  CHECK(sim_snapshot_restore(cloth, snapshot, NULL) == SIM_OK);
  CHECK(sim_hash(cloth, 0) == hash);
  CHECK(sim_step(cloth, 400, NULL, NULL) == SIM_OK);
  CHECK(sim_hash(cloth, 0) == CLOTH_HASH);
  CHECK(sim_energy(cloth, 0, &energies, NULL) == SIM_OK && energies.kinetic > 0);
  CHECK(sim_springs(cloth, 0, 12, springs, 2, &count, NULL) == SIM_OK);
  CHECK(count == 11 && strcmp(springs[0].family, "structural") == 0);
  CHECK(fabs(springs[0].force - springs[0].stiffness * (springs[0].length - springs[0].rest)) <
        1e-12);
  CHECK(sim_springs(cloth, 0, 640, springs, 2, &count, NULL) == SIM_USAGE);
  sim_snapshot_free(snapshot);
  sim_close(other);
  sim_close(cloth);
}

static void nothing_is_survived(void) {
  sim_error error;
  sim_part part;
  CHECK(sim_open(NULL, NULL, &error) == NULL && error.code == SIM_USAGE);
  CHECK(sim_open_text(NULL, "x", NULL, NULL) == NULL);
  CHECK(sim_open_field(NULL, NULL, NULL, 0, 1, NULL, NULL) == NULL);
  CHECK(sim_step(NULL, 1, NULL, &error) == SIM_USAGE && strcmp(error.what, "null handle") == 0);
  CHECK(sim_run(NULL, 1, 1, NULL, NULL, NULL) == SIM_USAGE);
  CHECK(sim_reset(NULL, NULL) == SIM_USAGE);
  CHECK(sim_systems(NULL) == 0 && sim_generation(NULL) == 0 && sim_hash(NULL, 0) == 0);
  CHECK(isnan(sim_time(NULL, 0)) && isnan(sim_step_size(NULL, 0)) && isnan(sim_duration(NULL, 0)));
  CHECK(sim_step_count(NULL, 0) == -1);
  CHECK(sim_snapshot_take(NULL, NULL) == NULL);
  CHECK(sim_snapshot_restore(NULL, NULL, NULL) == SIM_USAGE);
  CHECK(sim_state(NULL, 0, "position", &part, NULL) == SIM_USAGE);
  CHECK(sim_state_parts(NULL, 0, NULL) == NULL && sim_describe(NULL, NULL) == NULL);
  CHECK(sim_energy(NULL, 0, NULL, NULL) == SIM_USAGE);
  CHECK(sim_set_switch(NULL, 0, NULL, 0, NULL) == SIM_USAGE);
  CHECK(sim_judge(NULL, 0, NULL, NULL) == SIM_USAGE && sim_verdict_json(NULL, NULL) == NULL);
  CHECK(sim_study(NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL) == NULL);
  CHECK(sim_study("tradeoff", NULL, NULL, NULL, NULL, NULL, NULL, NULL) == NULL);
  CHECK(sim_picture(NULL, 8, 8, NULL, NULL, NULL) == NULL);
  CHECK(sim_writer_open(NULL, "x.csv", 30, NULL) == NULL);
  CHECK(sim_writer_add(NULL, NULL) == SIM_USAGE && sim_writer_commit(NULL, NULL) == SIM_USAGE);
  CHECK(sim_trust_name(-1)[0] == '\0' && sim_trust_name(5)[0] == '\0');
  sim_close(NULL);
  sim_snapshot_free(NULL);
  sim_writer_close(NULL);
  sim_free(NULL);
}

static void bad_scenes_are_told(void) {
  static const char* const bad_settings[] = {"m=3", NULL};
  static const char* const no_settings[] = {"n", NULL};
  sim_options options = SIM_OPTIONS;
  sim_error error;
  CHECK(sim_open("scenes/clot.lua", NULL, &error) == NULL && error.code == SIM_IO);
  CHECK(strstr(error.remedy, "cloth") != NULL);
  CHECK(sim_open_text("return 3", "mine.lua", NULL, &error) == NULL && error.code == SIM_SCENE);
  CHECK(sim_open_text("x = ", "mine.lua", NULL, &error) == NULL && error.code == SIM_SCENE);
  CHECK(strstr(error.where, "mine.lua") || strstr(error.why, "mine.lua"));
  CHECK(sim_open_text("while true do end", "mine.lua", NULL, &error) == NULL);
  options.settings = bad_settings;
  CHECK(sim_open("scenes/cloth.lua", &options, &error) == NULL && error.code == SIM_USAGE);
  options.settings = no_settings;
  CHECK(sim_open("scenes/cloth.lua", &options, &error) == NULL && error.code == SIM_USAGE);
  options.settings = NULL;
  options.threads = -1;
  CHECK(sim_open("scenes/cloth.lua", &options, NULL) == NULL);
  options.threads = 1;
  options.dt = NAN;
  CHECK(sim_open("scenes/cloth.lua", &options, NULL) == NULL);
  options.dt = 0;
  options.size = 3;
  CHECK(sim_open("scenes/cloth.lua", &options, NULL) == NULL);
  options.size = sizeof options;
  options.integrator = "rk4:";
  CHECK(sim_open("scenes/cloth.lua", &options, NULL) == NULL);
  /* Steps so large that the numbers end: a code, the last good state, and a verdict. */
  options.integrator = "euler";
  options.dt = 10;
  {
    sim_scene* cloth = open_or_tell("scenes/cloth.lua", &options);
    sim_verdict verdict;
    CHECK(sim_step(cloth, 1000000, NULL, &error) == SIM_DIVERGED && error.why[0]);
    CHECK(sim_reset(cloth, NULL) == SIM_OK);
    CHECK(sim_run(cloth, 1e6, 0, NULL, NULL, NULL) == SIM_OK);
    CHECK(sim_judge(cloth, 0, &verdict, NULL) == SIM_OK && verdict.trust == 4);
    sim_close(cloth);
  }
}

/* A circle, x' = (-y, x), and one that gives up. */
static int turn(void* user, double t, const double* x, double* dxdt, size_t n) {
  size_t i;
  if (user && t > 0.5) return 1;
  for (i = 0; i + 1 < n; i += 2) {
    dxdt[i] = -x[i + 1];
    dxdt[i + 1] = x[i];
  }
  return 0;
}

static void fields_are_functions(void) {
  static const double x0[4] = {1, 0, 0, 2};
  sim_options options = SIM_OPTIONS;
  sim_scene* circle;
  double x[4], t;
  int give_up = 1;
  options.dt = 0.01;
  circle = sim_open_field(turn, NULL, x0, 4, 1, &options, NULL);
  CHECK(sim_step(circle, 100, NULL, NULL) == SIM_OK);
  CHECK(sim_copy_state(circle, 0, "component", x, 4, NULL) == SIM_OK);
  CHECK(fabs(x[0] - cos(1)) < 1e-9 && fabs(x[1] - sin(1)) < 1e-9);
  CHECK(fabs(x[2] + 2 * sin(1)) < 1e-9 && fabs(x[3] - 2 * cos(1)) < 1e-9);
  sim_close(circle);
  circle = sim_open_field(turn, &give_up, x0, 4, 1, &options, NULL);
  CHECK(sim_step(circle, 100, NULL, NULL) == SIM_STOPPED);
  t = sim_time(circle, 0);
  CHECK(t > 0.45 && t <= 0.5);
  CHECK(sim_step(circle, 1, NULL, NULL) == SIM_STOPPED && sim_time(circle, 0) == t);
  sim_close(circle);
}

static void pictures_files_and_studies(const char* folder) {
  static const char* const asked[] = {"integrators=rk4", "time=0.1", NULL};
  static const char* const wrong[] = {"nonsense=1", NULL};
  sim_scene* cloth = open_or_tell("scenes/cloth.lua", NULL);
  struct watched seen = {0, 1};
  sim_error error;
  size_t size = 0;
  char file[512], *json;
  sim_writer* writer;
  FILE* read;
  unsigned char* png = sim_picture(cloth, 64, 48, "strain", &size, &error);
  CHECK(png && size > 100 && memcmp(png, "\x89PNG", 4) == 0);
  sim_free(png);
  CHECK(sim_picture(cloth, 0, 48, NULL, &size, NULL) == NULL);
  CHECK(sim_picture(cloth, 64, 48, "nonsense", &size, NULL) == NULL);
  snprintf(file, sizeof file, "%s/cloth.csv", folder);
  writer = sim_writer_open(cloth, file, 0, &error);
  CHECK(writer != NULL);
  CHECK(sim_writer_add(writer, NULL) == SIM_OK && sim_step(cloth, 1, NULL, NULL) == SIM_OK);
  CHECK(sim_writer_add(writer, NULL) == SIM_OK && sim_writer_commit(writer, NULL) == SIM_OK);
  sim_writer_close(writer);
  read = fopen(file, "r");
  CHECK(read != NULL);
  if (read) fclose(read);
  remove(file);
  CHECK(sim_writer_open(cloth, "x.nonsense", 30, &error) == NULL && error.code == SIM_USAGE);
  sim_close(cloth);

  json = sim_study("order", "scenes/circle.lua", NULL, asked, NULL, NULL, NULL, &error);
  CHECK(json && strstr(json, "\"rk4\""));
  sim_free(json);
  CHECK(sim_study("order", "scenes/circle.lua", NULL, wrong, NULL, NULL, NULL, &error) == NULL);
  CHECK(error.code == SIM_USAGE);
  CHECK(sim_study("nonsense", "scenes/circle.lua", NULL, NULL, NULL, NULL, NULL, &error) == NULL);
  CHECK(sim_study("order", "scenes/circle.lua", NULL, asked, NULL, watch, &seen, &error) == NULL);
  CHECK(error.code == SIM_STOPPED);
  json = sim_describe_plugins("spring", NULL, NULL);
  CHECK(json && strstr(json, "\"N/m\""));
  sim_free(json);
  CHECK(sim_describe_plugins("nonsense", NULL, NULL) == NULL);
  json = sim_scenes(NULL);
  CHECK(json && strstr(json, "scenes/cloth.lua"));
  sim_free(json);
}

/* A number behind "key": of JSON, from `from` on; not a number where there is none. */
static double number_in(const char* from, const char* key) {
  char quoted[64];
  const char* at;
  snprintf(quoted, sizeof quoted, "\"%s\":", key);
  at = from ? strstr(from, quoted) : NULL;
  return at ? strtod(at + strlen(quoted), NULL) : NAN;
}

static void methods_are_compared(void) {
  static const char* const asked[] = {"integrators=rk4,verlet,rk4", "dt=0.01,0.01,0.005", "time=1",
                                      NULL};
  static const char* const given[] = {"integrators=rk4", "time=1", "reference=dop853",
                                      "reference_dt=0.001", NULL};
  static const char* const wrong[][4] = {{"dt=-1", NULL},
                                         {"dt=x", NULL},
                                         {"integrators=rk4,verlet", "dt=1,2,3", NULL},
                                         {"integrators=nonsense", NULL},
                                         {"reference=rk4", "of=sag", NULL},
                                         {"time=1", "time=2", NULL},
                                         {"budget=1%", NULL}};
  struct watched seen = {0, 1};
  sim_error error;
  size_t i;
  char* json =
      sim_study("compare", "scenes/pendulum1.lua", NULL, asked, NULL, NULL, NULL, &error);
  const char *methods = json ? strstr(json, "\"methods\"") : NULL, *second, *third;
  second = methods ? strstr(methods, "\"verlet\"") : NULL;
  third = second ? strstr(second, "\"rk4\"") : NULL;
  CHECK(third != NULL);
  /* The orders of the methods. */
  CHECK(fabs(number_in(methods, "error") / number_in(third, "error") - 16) < 3);
  CHECK(number_in(second, "error") > 100 * number_in(methods, "error"));
  CHECK(number_in(methods, "steps") == 100 && number_in(third, "steps") == 200);
  sim_free(json);
  json = sim_study("compare", "scenes/pendulum1.lua", NULL, given, NULL, NULL, NULL, &error);
  CHECK(json && strstr(json, "a run of dop853") && strstr(json, "\"error\":null"));
  methods = json ? strstr(json, "\"methods\"") : NULL;
  CHECK(number_in(methods, "error") > 0 && number_in(methods, "error") < 1e-4);
  sim_free(json);
  for (i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
    CHECK(sim_study("compare", "scenes/pendulum.lua", NULL, wrong[i], NULL, NULL, NULL, &error) ==
          NULL);
    CHECK(error.code == SIM_USAGE && error.what[0] && error.why[0] && error.remedy[0]);
  }
  CHECK(sim_study("compare", "scenes/sample.lua", NULL, NULL, NULL, NULL, NULL, &error) == NULL &&
        error.code == SIM_USAGE);
  CHECK(sim_study("compare", "scenes/cloth.lua", NULL, NULL, NULL, watch, &seen, &error) == NULL &&
        error.code == SIM_STOPPED);
}

static void errors_are_asked_for(void) {
  sim_scene* scene = open_or_tell("scenes/pendulum1.lua", NULL);
  struct watched seen = {0, 1};
  sim_error error;
  sim_verdict verdict;
  double value = 0, dt = sim_step_size(scene, 0);
  char* json = sim_choose(scene, NULL, NULL, 1, NULL, NULL, &error);
  CHECK(json && strcmp(json, "{\"systems\":[null]}") == 0); /* it asks for nothing */
  sim_free(json);
  CHECK(sim_choose(scene, "nonsense", NULL, 1, NULL, NULL, &error) == NULL);
  CHECK(error.code == SIM_USAGE && error.what[0] && error.where[0] && error.remedy[0]);
  CHECK(sim_choose(scene, "1%", "nonsense", 1, NULL, NULL, NULL) == NULL);
  CHECK(sim_choose(scene, "1%", NULL, NAN, NULL, NULL, NULL) == NULL);
  CHECK(sim_choose(scene, "1%", NULL, INFINITY, NULL, NULL, NULL) == NULL);
  CHECK(sim_choose(scene, "1%", NULL, 1, watch, &seen, &error) == NULL);
  CHECK(error.code == SIM_STOPPED && sim_step_size(scene, 0) == dt);
  json = sim_choose(scene, "1 um", NULL, 1, NULL, NULL, &error);
  CHECK(json && strstr(json, "\"kept\":true") && number_in(json, "error") <= 1e-6);
  CHECK(sim_step_size(scene, 0) == number_in(json, "dt"));
  sim_free(json);
  CHECK(sim_run(scene, 1, 1, NULL, NULL, NULL) == SIM_OK);
  CHECK(sim_judge(scene, 0, &verdict, NULL) == SIM_OK && verdict.trust == 0);
  CHECK(sim_figure(scene, 0, "position_error", &value, NULL) == SIM_OK);
  CHECK(value == verdict.position_error && value <= 1e-5);
  CHECK(sim_figure(scene, 0, "verified", &value, NULL) == SIM_OK && value == 1);
  CHECK(sim_figure(scene, 0, "strain", &value, NULL) == SIM_OK);
  CHECK(sim_figure(scene, 0, "strane", &value, &error) == SIM_USAGE);
  CHECK(strstr(error.remedy, "strain") != NULL);
  CHECK(sim_figure(scene, 0, "strain", NULL, NULL) == SIM_USAGE);
  CHECK(sim_figure(scene, 0, NULL, &value, NULL) == SIM_USAGE);
  CHECK(sim_figure(NULL, 0, "strain", &value, NULL) == SIM_USAGE);
  CHECK(sim_choose(scene, "1%", NULL, 1, NULL, NULL, &error) == NULL && error.code == SIM_USAGE);
  CHECK(sim_choose(NULL, "1%", NULL, 1, NULL, NULL, NULL) == NULL);
  sim_close(scene);
  scene = open_or_tell("scenes/pendulum.lua", NULL);
  CHECK(sim_observe(scene, 0, "sag", &value, NULL) == SIM_OK && value == value);
  CHECK(sim_observe(scene, 0, "mean sag", &value, NULL) == SIM_USAGE);
  CHECK(sim_observe(scene, 0, "nonsense", &value, NULL) == SIM_USAGE);
  CHECK(sim_observe(scene, 0, "sag", NULL, NULL) == SIM_USAGE);
  CHECK(sim_observe(scene, 0, NULL, &value, NULL) == SIM_USAGE);
  CHECK(sim_observe(scene, 3, "sag", &value, NULL) == SIM_USAGE);
  CHECK(sim_observe(NULL, 0, "sag", &value, NULL) == SIM_USAGE);
  sim_close(scene);
}

static void scenes_are_swept(void) {
  static const char* const asked[] = {"over=n=4,8", "over=integrator=rk4,euler", "time=2", NULL};
  static const char* const texts[] = {"over=w=1..4", "over=dt=0.01:0.04:log3", "of=mean px", NULL};
  static const char* const wrong[][3] = {{NULL},
                                         {"over=n", NULL},
                                         {"over=nonsense=1", NULL},
                                         {"over=dt=-1", NULL},
                                         {"over=n=1:2", "cases=x.csv", NULL},
                                         {"over=n=4", "verify=2", NULL},
                                         {"over=n=1..10000000", NULL},
                                         {"over=n=4", "nonsense=1", NULL},
                                         {"over=tol=1e-3", "over=integrator=rkf45:tol=1", NULL}};
  static const char* const circle =
      "local sim = require 'sim' local w = sim.arg('w', 1, 'rad/s')\n"
      "return sim.scene { name = 'c', state = { x = {{1, 0, 0}} },\n"
      "  field = sim.field.rotation { omega = w }, integrator = 'rk4', dt = 0.01, duration = 1,\n"
      "  observe = { px = function(s) return s:position(0)[1] end } }";
  sim_options options = SIM_OPTIONS;
  struct watched seen = {0, 1};
  sim_error error;
  const char* row;
  char* json;
  size_t i;
  options.threads = 2;
  json = sim_study("sweep", "scenes/cloth.lua", NULL, asked, &options, NULL, NULL, &error);
  CHECK(json && strstr(json, "\"names\":[\"n\",\"integrator\"]"));
  row = json ? strstr(json, "\"case\":2") : NULL; /* 8 x 8 with rk4 */
  CHECK(row && strstr(row, "\"hash\":\"129f25ebe3e79c14\"") < strstr(row, "\"case\":3"));
  CHECK(number_in(row, "n") == 8 && number_in(row, "exit") == 0 && number_in(row, "steps") == 400);
  row = json ? strstr(json, "\"case\":3") : NULL;
  CHECK(number_in(row, "exit") == SIM_DIVERGED && strstr(row, "\"diverged\""));
  sim_free(json);
  /* cos(w) by the scene's own observation, for all 12 cases. */
  json = sim_study("sweep", "circle.lua", circle, texts, &options, NULL, NULL, &error);
  row = json ? strstr(json, "\"case\"") : NULL;
  for (i = 0; i < 12; ++i) {
    CHECK(number_in(row, "case") == (double)i && number_in(row, "w") == (double)(i / 3 + 1));
    CHECK(fabs(number_in(row, "px") - cos((double)(i / 3 + 1))) < 1e-4);
    CHECK(fabs(number_in(row, "mean px") - sin((double)(i / 3 + 1)) / (double)(i / 3 + 1)) < 1e-3);
    row = row ? strstr(row + 9, "\"case\"") : NULL;
  }
  CHECK(row == NULL);
  sim_free(json);
  for (i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
    CHECK(sim_study("sweep", "scenes/cloth.lua", NULL, wrong[i], NULL, NULL, NULL, &error) == NULL);
    CHECK(error.code == SIM_USAGE && error.what[0] && error.where[0] && error.why[0]);
  }
  CHECK(sim_study("sweep", "scenes/sample.lua", NULL, asked, NULL, NULL, NULL, &error) == NULL);
  CHECK(sim_study("sweep", NULL, NULL, asked, NULL, NULL, NULL, &error) == NULL);
  CHECK(sim_study("sweep", "scenes/cloth.lua", NULL, asked, &options, watch, &seen, &error) ==
            NULL &&
        error.code == SIM_STOPPED);
}

/* Lua that does not come to its end while a scene is read, and a large picture. */
static void loads_and_pictures_are_ended(void) {
  static const char* const endless = "local x = 0 while true do x = x + 1 end";
  struct watched seen = {0, 3};
  sim_options options = SIM_OPTIONS;
  sim_look look = SIM_LOOK;
  sim_error error;
  sim_scene* cloth;
  unsigned char *picture, *again;
  size_t size = 0, same = 0;
  CHECK(sim_open_watched("endless.lua", endless, NULL, watch, &seen, &error) == NULL);
  CHECK(error.code == SIM_STOPPED && seen.calls == 3 && strcmp(error.what, "stopped") == 0);
  CHECK(sim_open_watched(NULL, endless, NULL, watch, &seen, &error) == NULL &&
        error.code == SIM_USAGE);
  CHECK(sim_open_saved_watched("none.snap", NULL, watch, &seen, &error) == NULL &&
        error.code == SIM_IO);
  options.lua_budget = "steps=1e5";
  CHECK(sim_open_text(endless, "endless.lua", &options, &error) == NULL && error.code == SIM_SCENE);
  options.lua_budget = "steps";
  CHECK(sim_open("scenes/cloth.lua", &options, &error) == NULL && error.code == SIM_USAGE);
  CHECK(strstr(error.where, "lua_budget") && error.remedy[0]);
  seen.stop_at = 0;
  cloth = sim_open_watched("scenes/cloth.lua", NULL, NULL, watch, &seen, NULL);
  CHECK(cloth && sim_step(cloth, 400, NULL, NULL) == SIM_OK && sim_hash(cloth, 0) == CLOTH_HASH);
  seen.calls = 0;
  seen.stop_at = 1;
  look.width = 4000;
  look.height = 3000;
  CHECK(sim_draw_watched(cloth, &look, &size, watch, &seen, &error) == NULL);
  CHECK(error.code == SIM_STOPPED && seen.calls == 1 && size == 0);
  look.width = 320;
  look.height = 200;
  picture = sim_draw(cloth, &look, &size, NULL);
  seen.stop_at = 0;
  again = sim_draw_watched(cloth, &look, &same, watch, &seen, NULL);
  CHECK(picture && again && size == same && memcmp(picture, again, size) == 0);
  sim_free(picture);
  sim_free(again);
  CHECK(sim_draw_watched(cloth, &look, NULL, NULL, NULL, &error) == NULL && error.code == SIM_USAGE);
  CHECK(sim_draw_watched(NULL, &look, &size, NULL, NULL, &error) == NULL && error.code == SIM_USAGE);
  sim_close(cloth);
}

/* Changes by calls are written down, and repeated with the same bits. */
static void what_is_done_is_recorded(const char* folder) {
  static const double v[3] = {0.1, 0, -0.2};
  struct watched seen = {0, 1};
  sim_scene *cloth = open_or_tell("scenes/cloth.lua", NULL), *again;
  sim_snapshot* before = sim_snapshot_take(cloth, NULL);
  sim_error error;
  char file[512], line[540];
  uint64_t hash;
  FILE* text;
  snprintf(file, sizeof file, "%s/cloth.rec", folder);
  CHECK(sim_record_end(cloth, &error) == SIM_USAGE && error.what[0]);
  CHECK(sim_record(cloth, file, &error) == SIM_OK);
  CHECK(sim_record(cloth, file, &error) == SIM_USAGE && error.remedy[0]);
  CHECK(sim_snapshot_restore(cloth, before, &error) == SIM_USAGE);
  CHECK(sim_replay(cloth, file, 0, NULL, NULL, &error) == SIM_USAGE);
  CHECK(sim_step(cloth, 50, NULL, NULL) == SIM_OK && sim_set_pinned(cloth, 0, 12, 1, NULL) == SIM_OK);
  CHECK(sim_set_velocity(cloth, 0, 40, v, NULL) == SIM_OK);
  CHECK(sim_set_velocity(cloth, 0, 4000, v, NULL) == SIM_USAGE); /* which is not written down */
  CHECK(sim_run(cloth, 0.25, 0, NULL, NULL, NULL) == SIM_OK);
  hash = sim_hash(cloth, 0);
  CHECK(hash != CLOTH_HASH && sim_record_end(cloth, &error) == SIM_OK);
  CHECK(sim_record_end(cloth, &error) == SIM_USAGE);
  again = sim_open_recorded(file, NULL, NULL, NULL, &error);
  CHECK(again && sim_step_count(again, 0) == 0);
  CHECK(sim_replay(again, file, 1, NULL, NULL, &error) == SIM_OK);
  CHECK(sim_hash(again, 0) == hash && sim_step_count(again, 0) == 100);
  CHECK(sim_replay(again, file, 1, NULL, NULL, &error) == SIM_USAGE); /* it is not at its start */
  sim_close(again);
  again = sim_open_recorded(file, NULL, watch, &seen, &error);
  CHECK(again == NULL || sim_replay(again, file, 0, watch, &seen, &error) == SIM_STOPPED);
  sim_close(again);
  /* Other bits than those recorded, and lines that are none. */
  text = fopen(file, "a");
  CHECK(text && fputs("+1 pin 3\n", text) >= 0 && fclose(text) == 0);
  CHECK(sim_open_recorded(file, NULL, NULL, NULL, &error) == NULL && error.code == SIM_SCENE);
  snprintf(line, sizeof line, "%s:%d", file, 6);
  CHECK(strcmp(error.where, line) == 0 && error.why[0] && error.remedy[0]);
  text = fopen(file, "w");
  CHECK(text && fputs("scene scenes/cloth.lua\n+400 end 0000000000000001\n", text) >= 0 &&
        fclose(text) == 0);
  again = open_or_tell("scenes/cloth.lua", NULL);
  CHECK(sim_replay(again, file, 0, NULL, NULL, &error) == SIM_CHECK && error.remedy[0]);
  CHECK(sim_hash(again, 0) == CLOTH_HASH);
  sim_close(again);
  CHECK(sim_open_recorded(NULL, NULL, NULL, NULL, &error) == NULL && error.code == SIM_USAGE);
  CHECK(sim_open_recorded("none.rec", NULL, NULL, NULL, &error) == NULL && error.code == SIM_IO);
  CHECK(sim_record(NULL, file, &error) == SIM_USAGE && sim_record(cloth, NULL, NULL) == SIM_USAGE);
  CHECK(sim_record(cloth, file, &error) == SIM_USAGE && error.code == SIM_USAGE);
  CHECK(sim_replay(NULL, file, 0, NULL, NULL, &error) == SIM_USAGE);
  CHECK(sim_replay(cloth, NULL, 0, NULL, NULL, &error) == SIM_USAGE);
  CHECK(sim_replay(cloth, file, 3, NULL, NULL, &error) == SIM_USAGE);
  sim_snapshot_free(before);
  sim_close(cloth);
}

/* Files for other programs, and what they refuse; tests of Python compare them with the program's. */
static void other_programs_are_served(const char* folder) {
  static const char* const few[] = {"steps=10", "every=5", NULL};
  static const char* const wrong[][3] = {{"ranks=0", NULL},       {"ranks=2.5", NULL},
                                         {"nonsense=1", NULL},    {"time=1", "steps=1", NULL},
                                         {"compare=2", NULL},     {"engine=lampms", NULL},
                                         {"ranks=2", "launch=lmp", NULL}};
  static const char* const rope =
      "local sim = require 'sim' local p = sim.particles { mass = 0.1 }\n"
      "p:pin(p:add {0, 0, 0}) p:add {1, 0, 0}\n"
      "local s = sim.force.spring { stiffness = 5 } s:tie(0, 1)\n"
      "return sim.scene { particles = p, forces = { s }, integrator = 'verlet', dt = 0.01,\n"
      "  duration = 1 }";
  sim_scene* scene = sim_open_text(rope, "rope.lua", NULL, NULL);
  sim_error error;
  char file[512], *json, *notes = NULL;
  FILE* mesh;
  size_t i;
  CHECK(scene != NULL);
  snprintf(file, sizeof file, "%s/engine", folder);
  json = sim_export(scene, "lammps", file, few, &error);
  CHECK(json && number_in(json, "steps") == 10 && number_in(json, "springs") == 1);
  sim_free(json);
  CHECK(sim_export(NULL, "lammps", file, NULL, &error) == NULL && error.code == SIM_USAGE);
  CHECK(sim_export(scene, NULL, file, NULL, &error) == NULL && error.code == SIM_USAGE);
  CHECK(sim_export(scene, "lammps", NULL, NULL, &error) == NULL && error.code == SIM_USAGE);
  CHECK(sim_export(scene, "lampms", file, NULL, &error) == NULL && error.remedy[0]);
  CHECK(sim_export(scene, "page", "x.html", NULL, &error) == NULL && error.code == SIM_USAGE);
  for (i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
    CHECK(sim_run_engine(scene, wrong[i], 0, NULL, NULL, &error) == NULL);
    CHECK(error.code == SIM_USAGE && error.what[0] && error.where[0] && error.remedy[0]);
  }
  CHECK(sim_run_engine(NULL, NULL, 0, NULL, NULL, &error) == NULL && error.code == SIM_USAGE);
  CHECK(sim_run_engine(scene, NULL, -1, NULL, NULL, &error) == NULL && error.code == SIM_USAGE);
  CHECK(sim_time(scene, 0) == 0);
  sim_close(scene);
  snprintf(file, sizeof file, "%s/triangle.obj", folder);
  mesh = fopen(file, "w");
  CHECK(mesh && fputs("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 1 2\n", mesh) >= 0 &&
        fclose(mesh) == 0);
  json = sim_import(file, &notes, &error);
  CHECK(json && strstr(json, "3 points, 1 triangles") && notes && strstr(notes, "left out"));
  scene = json ? sim_open_text(json, "triangle.lua", NULL, &error) : NULL;
  CHECK(scene && sim_step(scene, 3, NULL, NULL) == SIM_OK);
  sim_close(scene);
  sim_free(json);
  sim_free(notes);
  json = sim_import(file, NULL, NULL);
  CHECK(json != NULL);
  sim_free(json);
  notes = file;
  CHECK(sim_import("none.obj", &notes, &error) == NULL && error.code == SIM_IO && notes == NULL);
  CHECK(sim_import(NULL, &notes, &error) == NULL && error.code == SIM_USAGE);
}

/* A callback that uses the scene whose run asks it, and closes it. */
static int intrudes(void* user, const char* what, double done) {
  sim_scene* scene = user;
  sim_error error;
  double number;
  sim_energies energies;
  (void)what, (void)done;
  CHECK(sim_step(scene, 1, NULL, &error) == SIM_USAGE && strcmp(error.what, "busy handle") == 0);
  CHECK(error.where[0] && error.why[0] && error.remedy[0]);
  CHECK(sim_run(scene, 1, 0, NULL, NULL, NULL) == SIM_USAGE && sim_reset(scene, NULL) == SIM_USAGE);
  CHECK(sim_choose(scene, "1%", NULL, 1, NULL, NULL, NULL) == NULL);
  CHECK(sim_energy(scene, 0, &energies, NULL) == SIM_USAGE && isnan(sim_time(scene, 0)));
  CHECK(sim_copy_state(scene, 0, "position", &number, 1, NULL) == SIM_USAGE);
  CHECK(sim_generation(scene) == 0 && sim_hash(scene, 0) == 0 && sim_step_count(scene, 0) == -1);
  CHECK(sim_set_pinned(scene, 0, 3, 1, NULL) == SIM_USAGE && sim_snapshot_take(scene, NULL) == NULL);
  CHECK(sim_record(scene, "x.rec", NULL) == SIM_USAGE && sim_record_end(scene, NULL) == SIM_USAGE);
  CHECK(sim_replay(scene, "x.rec", 0, NULL, NULL, NULL) == SIM_USAGE);
  CHECK(sim_export(scene, "lammps", "x", NULL, NULL) == NULL);
  CHECK(sim_run_engine(scene, NULL, 0, NULL, NULL, NULL) == NULL);
  CHECK(sim_draw_watched(scene, NULL, NULL, NULL, NULL, NULL) == NULL);
  CHECK(sim_picture(scene, 8, 8, NULL, NULL, NULL) == NULL);
  CHECK(sim_verdict_json(scene, NULL) == NULL && sim_describe(scene, NULL) == NULL);
  sim_close(scene);
  sim_close(scene); /* the second time while the first one waits for the end of the call */
  return 1;
}

static void a_scene_is_in_one_call(void) {
  sim_scene* cloth = open_or_tell("scenes/cloth.lua", NULL);
  CHECK(sim_run(cloth, 1, 0, intrudes, cloth, NULL) == SIM_STOPPED);
}

static void* steps_a_cloth(void* hash) {
  int i;
  for (i = 0; i < 5; ++i) {
    sim_scene* cloth = sim_open("scenes/cloth.lua", NULL, NULL);
    if (sim_run(cloth, 0, 2, NULL, NULL, NULL) == SIM_OK) *(uint64_t*)hash = sim_hash(cloth, 0);
    if (*(uint64_t*)hash != CLOTH_HASH) break;
    sim_close(cloth);
  }
  return NULL;
}

static void threads_do_not_meet(void) {
  pthread_t threads[2];
  uint64_t hashes[2] = {0, 0};
  int i;
  for (i = 0; i < 2; ++i) pthread_create(&threads[i], NULL, steps_a_cloth, &hashes[i]);
  for (i = 0; i < 2; ++i) pthread_join(threads[i], NULL);
  CHECK(hashes[0] == CLOTH_HASH && hashes[1] == CLOTH_HASH);
}

/* What was refused, where, why, and what to do: each in its place. */
static int says(const sim_error* error, const char* what, const char* where, const char* why,
                const char* remedy) {
  const int right = strcmp(error->what, what) == 0 && strcmp(error->where, where) == 0 &&
                    strcmp(error->why, why) == 0 && strcmp(error->remedy, remedy) == 0;
  if (!right) tell(error);
  return right;
}

static void refusals_say_what_where_and_why(const char* folder) {
  static const char* const no_value[] = {"n", NULL};
  static const char* const no_budget[] = {"budget", NULL};
  sim_scene* cloth = open_or_tell("scenes/cloth.lua", NULL);
  sim_options options = SIM_OPTIONS;
  sim_look look = SIM_LOOK;
  sim_error error;
  sim_part part;
  size_t size;
  char file[512];
  snprintf(file, sizeof file, "%s/refused.csv", folder);
  sim_step(NULL, 1, NULL, &error);
  CHECK(says(&error, "null handle", "scene", "there is nothing to work on",
             "give one that is open"));
  sim_open(NULL, NULL, &error);
  CHECK(says(&error, "null text", "name", "a text is wanted", "give one that ends with a zero byte"));
  sim_state(cloth, 3, "position", &part, &error);
  CHECK(says(&error, "no such system", "3", "the scene has 1", "they count from 0"));
  options.settings = no_value;
  sim_open("scenes/cloth.lua", &options, &error);
  CHECK(says(&error, "bad setting", "settings 'n'", "it is not NAME=VALUE", "write it like n=32"));
  options.settings = NULL;
  options.dt = -1;
  sim_open("scenes/cloth.lua", &options, &error);
  CHECK(says(&error, "bad value", "dt -1", "it must be above 0, or 0 for the scene's own",
             "give it in s, like 0.005"));
  options.dt = 0;
  options.threads = 1025;
  sim_open("scenes/cloth.lua", &options, &error);
  CHECK(says(&error, "bad value", "threads 1025", "it is not 1 .. 1024",
             "give the number of cores at most"));
  options.threads = 1024; /* the last of them */
  sim_close(open_or_tell("scenes/cloth.lua", &options));
  options.threads = 0;
  options.size = 9;
  sim_open("scenes/cloth.lua", &options, &error);
  CHECK(says(&error, "bad options", "size 9", "it is that of no version", "begin with SIM_OPTIONS"));
  look.width = 3;
  sim_draw(cloth, &look, &size, &error);
  CHECK(says(&error, "bad value", "width, height", "one of the two is 0", "give both, or none"));
  look.width = 0, look.height = 3;
  sim_draw(cloth, &look, &size, &error);
  CHECK(says(&error, "bad value", "width, height", "one of the two is 0", "give both, or none"));
  sim_writer_open(cloth, file, 2e6, &error);
  CHECK(says(&error, "bad value", "frames_per_second 2e+06", "it is out of range",
             "give a number like 30"));
  sim_verdict_json(cloth, &error);
  CHECK(says(&error, "no verdict", "scene", "there was no judged run", "call sim_run() first"));
  sim_run(cloth, 1, 3, NULL, NULL, &error);
  CHECK(says(&error, "bad value", "verify 3", "it is 0, 1 or 2", "1 is usual"));
  sim_run(cloth, NAN, 0, NULL, NULL, &error);
  CHECK(says(&error, "bad value", "time", "it is not a number", "give it in s"));
  sim_record_end(cloth, &error);
  CHECK(says(&error, "no recording", "scene", "none was begun, or it has ended",
             "call sim_record() first"));
  sim_choose(cloth, "1%", NULL, INFINITY, NULL, NULL, &error);
  CHECK(says(&error, "bad value", "time", "it is not a finite number", "give it in s"));
  sim_free(sim_study("minimal", "scenes/cloth.lua", NULL, no_budget, NULL, NULL, NULL, &error));
  CHECK(says(&error, "bad word", "asked 'budget'", "it is not NAME=VALUE",
             "write it like budget=1%"));
  sim_record(cloth, file, &error);
  sim_choose(cloth, "1%", NULL, 1, NULL, NULL, &error);
  CHECK(says(&error, "not in a recording", "choose", "a recording has steps and changes only",
             "end it before: sim_record_end()"));
  CHECK(sim_record_end(cloth, NULL) == SIM_OK && sim_step(cloth, 1, NULL, NULL) == SIM_OK);
  sim_choose(cloth, "1%", NULL, 1, NULL, NULL, &error);
  CHECK(says(&error, "not at its start", "scene",
             "trials begin with the state of the scene, which was stepped or changed since",
             "open it again, and choose first"));
  sim_close(cloth);
}

int main(int argc, char** argv) {
  CHECK(sim_interface_version() / 1000 == SIM_MAJOR && sim_version()[0]);
  structures_are_those_of_1_0();
  steps_have_the_known_bits();
  steps_are_counted();
  runs_are_judged();
  steps_are_ended();
  functions_of_scenes_are_ended();
  checkpoints_are_gone_on_from(argc > 1 ? argv[1] : ".");
  runs_are_asked_for_figures();
  loads_and_pictures_are_ended();
  what_is_done_is_recorded(argc > 1 ? argv[1] : ".");
  other_programs_are_served(argc > 1 ? argv[1] : ".");
  pictures_have_looks(argc > 1 ? argv[1] : ".");
  changes_are_made_and_undone();
  nothing_is_survived();
  bad_scenes_are_told();
  options_of_other_versions_are_read();
  fields_are_functions();
  pictures_files_and_studies(argc > 1 ? argv[1] : ".");
  methods_are_compared();
  scenes_are_swept();
  errors_are_asked_for();
  refusals_say_what_where_and_why(argc > 1 ? argv[1] : ".");
  a_scene_is_in_one_call();
  threads_do_not_meet();
  printf("%d passed, %d failed\n", passed, failed);
  return failed != 0;
}
