/* The C interface of sim, C99: scenes, runs, studies and pictures behind opaque handles.
 *
 * Rules of the whole interface:
 * - A function that can fail returns a code, 0 for success, and takes a sim_error* that is filled
 * in on failure; it may be null. No function ends the program, throws or installs signal handlers.
 * - Null handles and indices out of range are errors (SIM_USAGE), never undefined.
 * - There is no state besides the handles. One handle belongs to one thread at a time; different
 *   handles may be used in different threads at once. A scene that is in a call, of which a
 * callback may be part, refuses all others (SIM_USAGE, "busy handle"); sim_close() then frees it at
 * the end of that call.
 * - Units are SI: m, s, kg, N, J. Systems of a scene and particles count from 0.
 * - Text is UTF-8. Texts and blocks that a function gives away are freed with sim_free().
 * - What compiles against 1.x of this header runs with every later 1.y of the library.
 */
#ifndef SIM_H
#define SIM_H

#include <stddef.h>
#include <stdint.h>

#define SIM_MAJOR 1
#define SIM_MINOR 1

#ifdef __cplusplus
extern "C" {
#endif

/* Codes, those of the command line's exit. */
enum {
  SIM_OK = 0,
  SIM_INTERNAL = 1,
  SIM_USAGE = 2,
  SIM_SCENE = 3,
  SIM_DIVERGED = 4,
  SIM_IO = 5,
  SIM_CHECKPOINT = 6,
  SIM_PLUGIN = 7,
  SIM_CHECK = 8,
  SIM_STOPPED = 9 /* a callback asked for it; the handle may be used further */
};

/* An error: what went wrong, where (FILE:LINE, or an argument), why, and what to do about it. Texts
 * that are too long are cut at a character. */
typedef struct sim_error {
  int code;
  char what[256], where[512], why[1280], remedy[1024];
} sim_error;

typedef struct sim_scene sim_scene;       /* systems of a scene, as they are now */
typedef struct sim_snapshot sim_snapshot; /* the state of all systems of a scene */
typedef struct sim_writer sim_writer;     /* a file that moments of a scene are written to */

/* Told what is being done and how much of it is done, 0 to 1; on the caller's thread, at most about
 * 20 times a second. Another answer than 0 stops the work. */
typedef int (*sim_watch)(void* user, const char* what, double done);

/* How a scene is made. Begin with SIM_OPTIONS, so that members of later versions are 0. Lists end
 * with a null pointer, and may be null. */
typedef struct sim_options {
  size_t size;                  /* sizeof(sim_options) */
  const char* const* settings;  /* "n=32": parameters of the scene */
  const char* const* off;       /* switches that are off at the start */
  const char* const* without;   /* forces, colliders and families that are left out */
  const char* const* folders;   /* of plugins, before all others */
  const char* const* libraries; /* of plugins */
  const char* integrator;       /* "rk4", "dopri5:tol=1e-8"; null: the scene's own */
  double dt;                    /* s; 0: the scene's own */
  int threads;                  /* that a step may use; 0: 1. Bits do not depend on it */
  int safe;                     /* not 0: a stranger's scene, with no plugins of its own */
  uint64_t seed;                /* of random numbers in the scene */
  const char* lua_budget;       /* since 1.1: of the scene's Lua, "time=60,memory=4096,steps=1e9":
                                   s and MB in the whole run, as --lua-budget */
} sim_options;

#define SIM_OPTIONS \
  { sizeof(sim_options), 0, 0, 0, 0, 0, 0, 0.0, 0, 0, 0, 0 }

/* SIM_MAJOR * 1000 + SIM_MINOR of the library, and the version of the program, "0.2.0". */
int sim_interface_version(void);
const char* sim_version(void);
void sim_free(void* block); /* of what this library gave away; null is legal */

/* --- Scenes. A scene from a file, found as the command line finds it; or from its text, `name`
 * being what errors call it and `require` looks beside. Null on failure; options may be null. */
sim_scene* sim_open(const char* name, const sim_options* options, sim_error* error);
sim_scene* sim_open_text(const char* text, const char* name, const sim_options* options,
                         sim_error* error);
/* Since 1.1: the same, where `text` is null of a file, with somebody who is asked while the scene
 * is read and made: SIM_STOPPED. */
sim_scene* sim_open_watched(const char* name, const char* text, const sim_options* options,
                            sim_watch watch, void* user, sim_error* error);
void sim_close(sim_scene* scene); /* null is legal */

/* A first-order system of one's own, dx/dt = f(t, x) with n numbers: `field` fills in dxdt and
 * returns 0; other answers end the step with SIM_STOPPED. `x0` are n numbers; dt in s. */
typedef int (*sim_field)(void* user, double t, const double* x, double* dxdt, size_t n);
sim_scene* sim_open_field(sim_field field, void* user, const double* x0, size_t n, double duration,
                          const sim_options* options, sim_error* error);

int sim_systems(const sim_scene* scene);                      /* how many; 0 for null */
char* sim_describe(const sim_scene* scene, sim_error* error); /* JSON: systems, parameters, file */
/* JSON of plugins, an array: kind, name, parameters with type, unit, default, doc. Null for `name`:
 * all of them. */
char* sim_describe_plugins(const char* name, const sim_options* options, sim_error* error);
char* sim_scenes(sim_error* error); /* JSON: names of the scenes that sim_open finds */

/* --- Steps and time. */
/* So many steps of each system; `taken`, if not null, is how many of the last one. SIM_DIVERGED
 * where a step cannot be taken; the state is then that before it. Nobody is asked in between. */
int sim_step(sim_scene* scene, int64_t steps, int64_t* taken, sim_error* error);
/* Since 1.1: the same with somebody who is asked, also within long steps: SIM_STOPPED. And as many
 * of them as are done in `seconds` of wall time, perhaps none: SIM_STOPPED where these are fewer. A
 * step that is on its way then is given up: the state is the last that all systems came to, `taken`
 * steps of each, and steps that follow have the bits that they would have had. */
int sim_step_watched(sim_scene* scene, int64_t steps, int64_t* taken, sim_watch watch, void* user,
                     sim_error* error);
int sim_step_for(sim_scene* scene, int64_t steps, double seconds, int64_t* taken, sim_error* error);
/* A judged run of `time` s from here, at whose end stands a verdict; not above 0: to the end of the
 * scene's duration. The last step is shorter where it has to be. `verify`: 0 not by a second run
 * with half the step; 1 where that takes a second or a core is free, until it has seen enough to
 * doubt; 2 to the end. A run that diverges is no error: the verdict says so. Stopped by `watch`:
 * SIM_STOPPED, with the verdict "suspect"; without one where a function of the scene was ended. */
int sim_run(sim_scene* scene, double time, int verify, sim_watch watch, void* user,
            sim_error* error);
/* Since 1.1: a method and a step for each system that keep an error in a run of `time` s (not above
 * 0: the duration), found by trials and set; before any step or change. `allowed`: "1 mm", "1%" of
 * the size; null: what the scene asks for as its `error`, which sim_run() does by itself where it
 * comes first. `of`: null for positions, or what the scene observes. JSON {"systems": [..]}: what
 * `sim SCENE --error E --json` calls error_goal, null for a system of which nothing is asked. */
char* sim_choose(sim_scene* scene, const char* allowed, const char* of, double time,
                 sim_watch watch, void* user, sim_error* error);
int sim_reset(sim_scene* scene, sim_error* error);   /* to t = 0 with the initial bits */
double sim_time(const sim_scene* scene, int system); /* s; not a number for what is not there */
double sim_step_size(const sim_scene* scene, int system);   /* s; likewise */
double sim_duration(const sim_scene* scene, int system);    /* s; likewise */
int64_t sim_step_count(const sim_scene* scene, int system); /* -1 for what is not there */
/* Changes with every call that may have moved or changed what a sim_part points to. */
uint64_t sim_generation(const sim_scene* scene);

/* Since 1.1: brings each system to rest where it stays at its present time (--from-rest). JSON
 * {"systems": [..]} as the study `rest` has it; SIM_DIVERGED, with the state of before, where none
 * is found. */
char* sim_come_to_rest(sim_scene* scene, sim_watch watch, void* user, sim_error* error);

/* Since 1.1: checkpoints as the command line has them (--snap, --resume): files from which a scene
 * goes on bit for bit, with the books of its run. A file takes its name when it is whole. A scene
 * resumes what one that was opened likewise has saved; or it is opened with the file and the
 * parameters that the checkpoint names, over which `options` come. */
int sim_save(const sim_scene* scene, const char* file, sim_error* error);
int sim_resume(sim_scene* scene, const char* file, sim_error* error);
sim_scene* sim_open_saved(const char* file, const sim_options* options, sim_error* error);
sim_scene* sim_open_saved_watched(const char* file, const sim_options* options, sim_watch watch,
                                  void* user, sim_error* error);

/* Since 1.1: recordings, the files of --record and --replay: the scene's file, and then changes
 * with the steps between them, as lines of text. A recording begins with the initial state;
 * changes, resets and whole steps go into it until sim_record_end(), or sim_close(), which cannot
 * tell that lines are missing. It refuses what it cannot tell: checkpoints, snapshots,
 * sim_choose(), sim_come_to_rest(). A scene replays what one that was opened likewise has recorded,
 * in a judged run: SIM_CHECK where the bits are others; where the scene is another its bits are not
 * compared. Or it is opened with what the recording names, over which `options` come. */
int sim_record(sim_scene* scene, const char* file, sim_error* error);
int sim_record_end(sim_scene* scene, sim_error* error);
sim_scene* sim_open_recorded(const char* file, const sim_options* options, sim_watch watch,
                             void* user, sim_error* error);
int sim_replay(sim_scene* scene, const char* file, int verify, sim_watch watch, void* user,
               sim_error* error);

sim_snapshot* sim_snapshot_take(const sim_scene* scene, sim_error* error);
int sim_snapshot_restore(sim_scene* scene, const sim_snapshot* snapshot, sim_error* error);
void sim_snapshot_free(sim_snapshot* snapshot); /* null is legal */

/* --- The state. */
/* One named part of the state X: "position", "velocity", "component", ... Number c of item i is
 * data[i * item_stride + c * component_stride]. Valid as long as sim_generation() says
 * `generation`. */
typedef struct sim_part {
  const double* data;
  size_t count, components, item_stride, component_stride;
  uint64_t generation;
} sim_part;
int sim_state(const sim_scene* scene, int system, const char* name, sim_part* part,
              sim_error* error);
char* sim_state_parts(const sim_scene* scene, int system, sim_error* error); /* JSON: their names */
/* Items of a part, copied one after the other; `size` is the room in numbers. */
int sim_copy_state(const sim_scene* scene, int system, const char* name, double* out, size_t size,
                   sim_error* error);

typedef struct sim_energies {
  double kinetic, potential; /* J */
} sim_energies;
int sim_energy(const sim_scene* scene, int system, sim_energies* energies, sim_error* error);
uint64_t sim_hash(const sim_scene* scene, int system); /* of the bits of the state; 0: not there */

/* Since 1.1: what the scene observes now, by its name in `observe`. */
int sim_observe(const sim_scene* scene, int system, const char* name, double* value,
                sim_error* error);

/* Since 1.1: what constraints hold with now, JSON: an array of {"constraint", "a", "b", "tension",
 * "force"}, N; particles are a and b, -1 where there is no second, and the force is that on a. */
char* sim_tensions(const sim_scene* scene, int system, sim_error* error);

typedef struct sim_spring {
  int to;                                /* the particle at its other end */
  double stiffness, rest, length, force; /* N/m, m, m, N: positive when stretched */
  char family[64];
} sim_spring;
/* Springs of a particle: at most `room` of them are stored; how many there are in `count`. */
int sim_springs(const sim_scene* scene, int system, int particle, sim_spring* springs, size_t room,
                size_t* count, sim_error* error);

/* --- Changes between two steps. One that is refused leaves all as it was. */
int sim_set_position(sim_scene* scene, int system, int particle, const double x[3],
                     sim_error* error); /* m */
int sim_set_velocity(sim_scene* scene, int system, int particle, const double v[3],
                     sim_error* error); /* m/s */
int sim_set_component(sim_scene* scene, int system, int component, double value, sim_error* error);
int sim_set_pinned(sim_scene* scene, int system, int particle, int pinned, sim_error* error);
int sim_set_switch(sim_scene* scene, int system, const char* name, int on, sim_error* error);
int sim_set_dt(sim_scene* scene, int system, double dt, sim_error* error); /* s */
int sim_set_integrator(sim_scene* scene, int system, const char* integrator, sim_error* error);
int sim_cut(sim_scene* scene, int system, int a, int b, sim_error* error);

/* --- The verdict on the last sim_run(). Not a number: not known. */
typedef struct sim_verdict {
  int trust;             /* 0 trusted, 1 unverified, 2 chaotic, 3 suspect, 4 diverged */
  double energy;         /* largest error of energy + work over the energy in play */
  double dt_share;       /* of the largest stable step */
  double step_error;     /* m, of one step */
  double momentum;       /* change over the momentum in play, where it must hold */
  double position_error; /* m, against the run with half the step, the largest */
  double position_share; /* of the scene's size */
  double horizon;        /* s; positions are known until then */
  double seconds;        /* of wall time that the run took */
} sim_verdict;
int sim_judge(const sim_scene* scene, int system, sim_verdict* verdict, sim_error* error);
/* Since 1.1: any of the "figures" of that JSON by its name, "strain"; 0 or 1 for a flag. */
int sim_figure(const sim_scene* scene, int system, const char* name, double* value,
               sim_error* error);
/* Since 1.1: figures of what the scene observes, "mean sag", that runs from now on judge besides
 * (--of), in "observed" of that JSON. The list ends with a null pointer. And whether the last run
 * is within limits (--check), "verified,energy=1%,strain=20%,dt=90%"; SIM_CHECK where not. */
int sim_judge_figures(sim_scene* scene, const char* const* of, sim_error* error);
int sim_check(const sim_scene* scene, const char* limits, sim_error* error);
char* sim_verdict_json(const sim_scene* scene, sim_error* error); /* as `sim SCENE --json` */
const char* sim_trust_name(int trust); /* "trusted", ..; "" for another number */

/* --- Studies: tradeoff, stability, order, compare, rest, sweep, and those that plugins bring
 * (minimal, extremes). JSON as `sim STUDY SCENE --json` has it; in a world {"systems": [..]}.
 * `text`: null, or the scene itself, `scene` being its name then. `asked`: "NAME=VALUE" texts that
 * end with a null pointer, may be null. Times in s, lists between commas:
 *   of=NAME, time=S           what is judged, and for how long: tradeoff, order, compare, sweep
 *   integrators=A,B           tradeoff, stability, order, compare
 *   budget=1%                 tradeoff
 *   csv=FILE                  tradeoff, since 1.1: a table of all runs, .csv or .jsonl
 *   svg=FILE                  tradeoff, stability, since 1.1: the plot; of one system
 *   at=S                      stability: in the state that the run has reached then
 *   dt=S,S                    compare: a step for all methods or for each; 0 is the scene's own
 *   reference=A, reference_dt=S  compare: errors against a run of this, in place of a reference
 *                                with an error of its own
 *   out=FILE, fps=N           compare: a panel for each method, of any kind that --out knows, may
 *                             be there often; with color, camera, size=WxH, springs (often) and
 *                             wireframe=1, surface=1 and trails (often), as in sim_look
 *   over=NAME=VALUES          sweep, once for each name: a,b,c or LO:HI:linN, LO:HI:logN, LO..HI;
 *                             NAME is integrator, dt, tol, time, steps, seed or a parameter
 *   cases=FILE                sweep, in place of over: CSV, names and then a row a case
 *   verify=0                  sweep: no second run with half the step; `of` may be there often
 * and parameters of plugins. A sweep runs as many cases at once as the options have threads; its
 * rows are {"rows": [{"case", names.., "exit", "verdict", "reason", "steps", .., "hash", ..}]}. */
char* sim_study(const char* study, const char* scene, const char* text, const char* const* asked,
                const sim_options* options, sim_watch watch, void* user, sim_error* error);

/* --- Pictures and files. */
/* The scene as it is now, as a PNG of `*size` bytes; `colour`: null, or as --color. */
unsigned char* sim_picture(sim_scene* scene, int width, int height, const char* colour,
                           size_t* size, sim_error* error);
/* Since 1.1: the same in any look. Begin with SIM_LOOK, so that members of later versions are 0;
 * null: as the scene says. */
typedef struct sim_look {
  size_t size;                /* sizeof(sim_look) */
  int width, height;          /* pixels; 0: 1280 x 720 */
  const char* color;          /* "strain", "speed:2", as --color */
  const char* camera;         /* "eye=1,2,3 at=0,0,0 up=0,1,0 fov=40", or parts, as --camera */
  const char* const* springs; /* that are drawn, "12", "shear", "all"; ends with a null pointer */
  int wireframe;              /* not 0: only the lines of surfaces */
  const char* const* trails;  /* of films: "12", "body:0", through the moments of the file */
  int surface;                /* not 0: liquids are drawn as surfaces */
} sim_look;

#define SIM_LOOK \
  { sizeof(sim_look), 0, 0, 0, 0, 0, 0, 0, 0 }

unsigned char* sim_draw(sim_scene* scene, const sim_look* look, size_t* size, sim_error* error);
/* Since 1.1: with somebody who is asked, as large pictures take long: SIM_STOPPED. */
unsigned char* sim_draw_watched(sim_scene* scene, const sim_look* look, size_t* size,
                                sim_watch watch, void* user, sim_error* error);

/* A file of any kind that --out knows, by its ending; it takes its name at sim_writer_commit(), and
 * without that none is left. The scene outlives the writer. */
sim_writer* sim_writer_open(sim_scene* scene, const char* file, double frames_per_second,
                            sim_error* error);
/* Since 1.1: with a look; and an end that can be stopped, as films take long: none is left then. */
sim_writer* sim_writer_open_look(sim_scene* scene, const char* file, double frames_per_second,
                                 const sim_look* look, sim_error* error);
int sim_writer_finish(sim_writer* writer, sim_watch watch, void* user, sim_error* error);
int sim_writer_add(sim_writer* writer, sim_error* error); /* the scene as it is now */
int sim_writer_commit(sim_writer* writer, sim_error* error);
void sim_writer_close(sim_writer* writer); /* null is legal */

/* --- Other programs, since 1.1. */
/* A judged run whose steps an engine makes (--engine). `asked`, "NAME=VALUE" texts that end with a
 * null pointer, may be null:
 *   engine=NAME        lammps if not given; sim_describe_plugins() knows them
 *   ranks=N, launch=WORDS  processes of it, or the words that start it
 *   compare=0          its first steps are not compared with those of the kernel
 *   time=S, steps=N    from the start of the scene; its duration if not given
 *   results=FOLDER     what was run there by hand: of an export, whose scene this is
 * JSON {"engine", "notes": [..]}, how far it agrees. SIM_CHECK where it does not, SIM_IO where it
 * cannot be started or fails. */
char* sim_run_engine(sim_scene* scene, const char* const* asked, int verify, sim_watch watch,
                     void* user, sim_error* error);
/* The scene as it is now for `format`: an engine, "lammps", whose files go into the folder `to`;
 * "h5md", a file .h5; "page", a file .html with the kernel in it. `asked`, of an engine: time=S or
 * steps=N, every=N steps a state. JSON of what was written, as `sim export --json` has it. A folder
 * is opened again by sim_open_saved(), for the results of the engine. */
char* sim_export(sim_scene* scene, const char* format, const char* to, const char* const* asked,
                 sim_error* error);
/* A mesh (.obj, .ply) or H5MD (.h5) as a scene in Lua, for sim_open_text(). `notes`, which may be
 * null, receives what it cannot express, a line each; it is freed with sim_free(), too. */
char* sim_import(const char* file, char** notes, sim_error* error);

#ifdef __cplusplus
}
#endif

#endif
