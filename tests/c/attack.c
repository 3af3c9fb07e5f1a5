/* Calls of sim.h at random, with arguments that nobody should give: nothing may crash, hang or leave
 * an error without its text. `attack FOLDER [CALLS [SEED]]`: where files may be made. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sim.h"

enum { SCENES = 4, LONG_TEXT = 10 * 1000 * 1000 };

static uint64_t state;
static sim_scene* scenes[SCENES]; /* some are null */
static sim_snapshot* snapshots[SCENES];
static sim_writer* writers[SCENES];
static sim_error error;
static char* long_text;
static int wrong = 0, refused = 0, done = 0;

/* Marsaglia (2003), xorshift. */
static uint64_t any(void) {
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return state;
}
static int below(int n) { return (int)(any() % (uint64_t)n); }

static const char* text(void) {
  static const char* const texts[] = {
      "", "position", "velocity", "component", "strain", "speed:2", "rk4", "verlet", "dopri5:tol=1e-6",
      "rk4:", ":", "=", "n=4", "n=1e9", "n=-1", "n=nan", "%s%n%n%s", "\xff\xfe\x80", "\xc3", "a\nb\tc",
      "../../../x", "/nonexistent/x.png", "/proc/self/mem", "/dev/full", "x.csv", "x.png", "x.npz", "x",
      "mean sag", "sag", "1 mm", "1%", "1e400", "-1", "verified,energy=1%", "energy=", "scenes/cloth.lua",
      "scenes/pendulum.lua", "scenes/circle.lua", "scenes/sample.lua", "scenes/stack.lua", "cloth",
      "return 3", "error('x')", "while true do end", "return sim.scene {", "tradeoff", "order", "rest",
      "lammps", "petsc", "h5md", "page", "x.rec", "x.h5", "x.html", "x.obj", "engine=lammps", "launch=x",
      "ranks=3", "results=x", "steps=7", "every=2", "svg=x.svg", "csv=x.csv", "time=3,steps=1e6",
      "stability", "compare", "sweep", "minimal", "over=n=4,5", "over=dt=0.01:0.02:log2", "time=0.05",
      "time=inf", "integrators=rk4,verlet", "eye=1,2,3 at=0,0,0", "eye=nan,0,0", "all", "12", "links"};
  const int count = (int)(sizeof texts / sizeof *texts), k = below(count + 3);
  return k < count ? texts[k] : k == count ? NULL : k == count + 1 ? long_text : "scenes/cloth.lua";
}

static double number(void) {
  static const double numbers[] = {0,      -0.0,   1,    -1,   0.005, 1e-300, 1e300, -1e300, 0.1,
                                   1e-9,   1e9,    2.5,  0.01, 3,     1e18,   5e-324};
  const int count = (int)(sizeof numbers / sizeof *numbers), k = below(count + 3);
  return k < count ? numbers[k] : k == count ? NAN : k == count + 1 ? INFINITY : -INFINITY;
}

static int integer(void) {
  static const int integers[] = {0, 1, 2, 3, 5, 63, 64, -1, 100, 2147483647, -2147483647 - 1, 1 << 20};
  return integers[below((int)(sizeof integers / sizeof *integers))];
}

/* A list that ends with a null pointer, or none. */
static const char* const* list(void) {
  static const char* texts[4];
  int i, count = below(4);
  for (i = 0; i < count; ++i) {
    texts[i] = text();
    if (!texts[i]) break;
  }
  texts[i] = NULL;
  return below(5) ? (const char* const*)texts : NULL;
}

static const sim_options* options(void) {
  static sim_options given;
  static const char* texts[6][4];
  const char* const** const lists[] = {&given.settings, &given.off, &given.without, &given.folders,
                                       &given.libraries};
  const sim_options usual = SIM_OPTIONS;
  int i, k;
  if (below(3) == 0) return NULL;
  given = usual;
  for (i = 0; i < 5; ++i) {
    if (below(4)) continue;
    for (k = 0; k < 1 + below(3); ++k) texts[i][k] = text();
    texts[i][k] = NULL;
    *lists[i] = (const char* const*)texts[i];
  }
  if (below(4) == 0) given.integrator = text();
  if (below(4) == 0) given.dt = number();
  if (below(4) == 0) given.threads = integer() % 9;
  if (below(8) == 0) given.safe = 1;
  if (below(4) == 0) given.seed = any();
  if (below(6) == 0) given.lua_budget = below(2) ? "time=2,memory=200,steps=1e7" : text();
  if (below(8) == 0) given.size = (size_t)any() >> below(64);
  if (given.size > sizeof given) given.size = below(2) ? (size_t)-8 : 3; /* what lies behind is ours */
  return &given;
}

static const sim_look* look(void) {
  static sim_look given;
  const sim_look usual = SIM_LOOK;
  if (below(4) == 0) return NULL;
  given = usual;
  given.width = below(3) ? 64 : integer();
  given.height = below(3) ? 48 : integer();
  if (below(3) == 0) given.color = text();
  if (below(3) == 0) given.camera = text();
  if (below(3) == 0) given.springs = list();
  given.wireframe = below(2);
  if (below(3) == 0) given.trails = list();
  if (below(8) == 0) given.size = (size_t)below(sizeof given);
  return &given;
}

/* Ends what it is asked for. */
static int watch(void* user, const char* what, double share) {
  if (!what || !(share >= 0 && share <= 1)) ++wrong;
  return ++*(int*)user > 1;
}

static int field(void* user, double t, const double* x, double* dxdt, size_t n) {
  size_t i;
  (void)user;
  for (i = 0; i < n; ++i) dxdt[i] = t > 0.05 ? NAN : -x[i];
  return t > 0.1;
}

static void judge(int code) {
  ++done;
  if (code == SIM_OK) return;
  ++refused;
  if (code < 0 || code > SIM_STOPPED || error.code != code || !error.what[0] || !error.where[0]) {
    ++wrong;
    printf("a bad error: %d, %d: %s: %s\n", code, error.code, error.what, error.where);
  }
}
static void judge_block(void* block) {
  judge(block ? SIM_OK : error.code ? error.code : -1);
  sim_free(block);
}

/* With springs, an observer, constraints, bodies, a flat state, or several systems. */
static sim_scene* known_scene(void) {
  static const char* const names[] = {"scenes/cloth.lua",  "scenes/pendulum.lua", "scenes/rope.lua",
                                      "scenes/cradle.lua", "scenes/lorenz.lua",   "scenes/sample.lua"};
  return sim_open(names[below((int)(sizeof names / sizeof *names))], NULL, &error);
}

static sim_scene* scene(void) { return scenes[below(SCENES)]; }

static void replace(sim_scene* opened) {
  const int k = below(SCENES);
  int i;
  judge(opened ? SIM_OK : error.code ? error.code : -1);
  if (!opened) return;
  /* Writers are of their scene, and go before it. */
  for (i = 0; i < SCENES && scenes[k]; ++i) {
    sim_writer_close(writers[i]);
    writers[i] = NULL;
  }
  sim_close(scenes[k]);
  scenes[k] = opened;
}

static void call(void) {
  static double numbers[3 * 64];
  static const double x0[3] = {1, 2, 3}, bad[3] = {0, INFINITY, 0};
  double vector[3] = {0, 0, 0}, value;
  int asked = 0, i = below(SCENES), system = below(3) ? 0 : integer();
  int64_t taken;
  size_t size;
  sim_part part;
  sim_energies energies;
  sim_spring springs[4];
  sim_verdict verdict;
  sim_error* const told = &error;
  memset(told, 0, sizeof *told);
  for (size = 0; size < 3; ++size) vector[size] = number();
  switch (below(54)) {
    case 0: replace(below(2) ? known_scene() : sim_open(text(), options(), told)); break;
    case 1: replace(sim_open_text(text(), text(), options(), told)); break;
    case 2:
      replace(sim_open_field(below(8) ? field : NULL, NULL, below(8) ? x0 : below(2) ? bad : NULL,
                             (size_t)below(4), number(), options(), told));
      break;
    case 3: replace(sim_open_saved(text(), options(), told)); break;
    case 4: judge(sim_step(scene(), below(4) - 1, below(2) ? &taken : NULL, told)); break;
    case 5:
      judge(sim_step_watched(scene(), (int64_t)any() >> below(64), &taken, watch, &asked, told));
      break;
    case 6:
      value = number();
      judge(sim_step_for(scene(), (int64_t)any() >> below(64), value > 0.01 ? 0.01 : value, &taken,
                         told));
      break;
    case 7: judge(sim_run(scene(), number(), below(4) - 1, watch, &asked, told)); break;
    case 8:
      judge_block(sim_choose(scene(), text(), below(3) ? NULL : text(), number(), watch, &asked, told));
      break;
    case 9: judge(sim_reset(scene(), told)); break;
    case 10:
      sim_snapshot_free(snapshots[i]);
      snapshots[i] = sim_snapshot_take(scene(), told);
      judge(snapshots[i] ? SIM_OK : error.code);
      break;
    case 11: judge(sim_snapshot_restore(scene(), snapshots[i], told)); break;
    case 12: judge(sim_state(scene(), system, text(), below(8) ? &part : NULL, told)); break;
    case 13:
      judge(sim_copy_state(scene(), system, below(2) ? "position" : text(), below(8) ? numbers : NULL,
                           below(2) ? sizeof numbers / sizeof *numbers : (size_t)below(9), told));
      break;
    case 14: judge(sim_energy(scene(), system, below(8) ? &energies : NULL, told)); break;
    case 15: judge(sim_observe(scene(), system, text(), below(8) ? &value : NULL, told)); break;
    case 16:
      judge(sim_springs(scene(), system, integer(), below(8) ? springs : NULL, (size_t)below(5),
                        below(2) ? &size : NULL, told));
      break;
    case 17: judge(sim_set_position(scene(), system, integer(), below(8) ? vector : NULL, told)); break;
    case 18: judge(sim_set_velocity(scene(), system, integer(), below(8) ? vector : NULL, told)); break;
    case 19: judge(sim_set_component(scene(), system, integer(), number(), told)); break;
    case 20: judge(sim_set_pinned(scene(), system, integer(), integer(), told)); break;
    case 21: judge(sim_set_switch(scene(), system, text(), below(2), told)); break;
    case 22: judge(sim_set_dt(scene(), system, number(), told)); break;
    case 23: judge(sim_set_integrator(scene(), system, text(), told)); break;
    case 24: judge(sim_cut(scene(), system, integer(), integer(), told)); break;
    case 25: judge(sim_judge(scene(), system, below(8) ? &verdict : NULL, told)); break;
    case 26: judge(sim_figure(scene(), system, text(), below(8) ? &value : NULL, told)); break;
    case 27: judge_block(sim_verdict_json(scene(), told)); break;
    case 28:
      judge_block(sim_study(text(), text(), below(3) ? NULL : text(), list(), options(), watch, &asked,
                            told));
      break;
    case 29:
      judge_block(sim_picture(scene(), below(4) ? 64 : integer(), 48, below(3) ? NULL : text(),
                              below(8) ? &size : NULL, told));
      break;
    case 30: judge_block(sim_draw(scene(), look(), below(8) ? &size : NULL, told)); break;
    case 31:
    case 32:
      sim_writer_close(writers[i]);
      writers[i] = below(2) ? sim_writer_open(scene(), text(), number(), told)
                            : sim_writer_open_look(scene(), text(), number(), look(), told);
      judge(writers[i] ? SIM_OK : error.code);
      break;
    case 33: judge(sim_writer_add(writers[i], told)); break;
    case 34:
      judge(below(2) ? sim_writer_commit(writers[i], told)
                     : sim_writer_finish(writers[i], watch, &asked, told));
      sim_writer_close(writers[i]);
      writers[i] = NULL;
      break;
    case 35: judge(sim_save(scene(), text(), told)); break;
    case 36: judge(sim_resume(scene(), text(), told)); break;
    case 37: judge_block(sim_come_to_rest(scene(), watch, &asked, told)); break;
    case 38: judge(sim_judge_figures(scene(), list(), told)); break;
    case 39: judge(sim_check(scene(), text(), told)); break;
    case 40: judge_block(sim_tensions(scene(), system, told)); break;
    case 41: judge_block(sim_describe(scene(), told)); break;
    case 42: judge_block(sim_describe_plugins(text(), options(), told)); break;
    case 43: judge_block(sim_state_parts(scene(), system, told)); break;
    case 44: judge_block(below(8) ? sim_describe(scene(), told) : sim_scenes(told)); break;
    case 45:
      replace(sim_open_watched(text(), below(2) ? text() : NULL, options(), watch, &asked, told));
      break;
    case 46: replace(sim_open_saved_watched(text(), options(), watch, &asked, told)); break;
    case 47: judge_block(sim_draw_watched(scene(), look(), &size, watch, &asked, told)); break;
    case 48: judge(sim_record(scene(), text(), told)); break;
    case 49: judge(sim_record_end(scene(), told)); break;
    case 50:
      if (below(2))
        judge(sim_replay(scene(), text(), below(4) - 1, watch, &asked, told));
      else
        replace(sim_open_recorded(text(), options(), watch, &asked, told));
      break;
    case 51: judge_block(sim_run_engine(scene(), list(), below(3), watch, &asked, told)); break;
    case 52:
      if (below(2)) {
        judge_block(sim_export(scene(), text(), text(), list(), told));
      } else {
        char* notes = NULL;
        judge_block(sim_import(text(), below(2) ? &notes : NULL, told));
        sim_free(notes);
      }
      break;
    default:
      sim_time(scene(), integer()), sim_step_size(scene(), integer());
      sim_duration(scene(), integer()), sim_step_count(scene(), integer());
      sim_generation(scene()), sim_hash(scene(), integer()), sim_systems(scene());
      sim_trust_name(integer()), sim_interface_version(), sim_version();
  }
}

int main(int count, char** arguments) {
  const int calls = count > 2 ? atoi(arguments[2]) : 1500;
  int i;
  if (count < 2 || chdir(arguments[1]) != 0) return 2;
  state = count > 3 ? strtoull(arguments[3], NULL, 10) : 42;
  if (state == 0) state = 1;
  long_text = malloc(LONG_TEXT + 1);
  if (!long_text) return 2;
  memset(long_text, 'x', LONG_TEXT);
  long_text[LONG_TEXT] = '\0';
  for (i = 0; i + 1 < SCENES; ++i) scenes[i] = known_scene();
  for (i = 0; i < calls; ++i) call();
  for (i = 0; i < SCENES; ++i) {
    sim_writer_close(writers[i]);
    sim_snapshot_free(snapshots[i]);
  }
  for (i = 0; i < SCENES; ++i) sim_close(scenes[i]);
  free(long_text);
  printf("%d calls, %d refused; %d passed, %d failed\n", done, refused, done - wrong, wrong);
  return wrong != 0;
}
