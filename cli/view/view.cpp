#include "cli/view/view.h"

#include <poll.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <optional>

#include "cli/terminal/cells.h"
#include "cli/terminal/signals.h"
#include "cli/view/browser_launch.h"
#include "cli/view/command_queue.h"
#include "cli/view/live.h"
#include "cli/view/terminal.h"
#include "core/base/error.h"
#include "core/base/stopwatch.h"
#include "core/output/view.h"
#include "core/report/recording_file.h"
#include "core/report/replays.h"

namespace sim::cli {
namespace {

constexpr double kQuiet = 0.2;           // s between frames where nothing changes
constexpr double kFrame = 1.0 / 60;      // s between two frames
constexpr double kLongestSilence = 0.1;  // s of steps without a picture
constexpr double kStepShare = 0.75;      // of it, for steps

using Clock = std::chrono::steady_clock;

// The first system of the scene once with each method.
LoadedScene side_by_side(const LoadedScene& scene, const ViewRequest& request, Registry& registry) {
  LoadedScene panels;
  panels.spec = scene.spec;
  panels.spec.world = true;
  panels.spec.systems.clear();
  for (const MethodChoice& choice : request.compare) {
    SystemSpec spec = scene.spec.systems.front();
    SceneRequest own = request.scene;
    own.integrator = choice;
    spec.integrator = run_options(own, spec, registry).integrator;
    spec.name = Method(registry, spec.integrator).label();
    if (request.scene.dt > 0) spec.dt = request.scene.dt;
    panels.spec.systems.push_back(std::move(spec));
  }
  for (const SystemSpec& spec : panels.spec.systems)
    panels.systems.emplace_back(spec, registry, RunOptions{.threads = request.scene.threads});
  return panels;
}

Clock::duration span(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

std::string random_token() {
  unsigned char bytes[16];
  if (::getrandom(bytes, sizeof bytes, 0) != static_cast<ssize_t>(sizeof bytes))
    throw Error(ErrorKind::kIo, {"no random numbers", "", "the system gives none", ""});
  std::string token;
  for (const unsigned char byte : bytes) {
    token += "0123456789abcdef"[byte >> 4];
    token += "0123456789abcdef"[byte & 15];
  }
  return token;
}

const Plugin<View>& plugin_of(bool window, Registry& registry) {
  if (const PluginInfo* found = registry.find(kind_of<View>, window ? "window" : "web"))
    return static_cast<const Plugin<View>&>(*found);
  if (window)
    throw Error(ErrorKind::kIo, {"no window", "sim view --window", "this build has none",
                                 "install libglfw3-dev, libepoxy-dev and libimgui-dev and build "
                                 "again, or leave out --window"});
  throw Error(ErrorKind::kIo,
              {"no page", "sim view", "this build has no web server",
               "install libboost-dev and build again, or look with --window or --terminal"});
}

// The scene that is seen, and the next one when a parameter of it changes.
class Stage {
 public:
  Stage(const ViewRequest& request, const Environment& environment, Registry& registry)
      : request_(request), environment_(&environment), registry_(&registry) {
    put_on(request.scene);
  }

  Stage(Live& lent, const ViewRequest& request, const Environment& environment)
      : request_(request), environment_(&environment), lent_(&lent) {}

  Live& live() { return lent_ ? *lent_ : *live_; }
  const SceneSpec& spec() const { return scene_->spec; }

  // From the start, with another value. Throws as load() does, and goes on with what it had.
  void set(const std::string& name, const std::string& value) {
    if (lent_)
      throw Error(ErrorKind::kUsage, {"no other scene", name, "the scene is that of the prompt",
                                      "close this and say .set " + name + " " + value});
    if (request_.record)
      throw Error(ErrorKind::kUsage, {"no other scene", name, "what is recorded is of one scene",
                                      "start sim view with -s " + name + "=" + value});
    SceneRequest next = request_.scene;
    next.settings[name] = value;
    put_on(next);
  }

  // Begins and ends the search for a method and a step that keep the error that somebody asks for.
  void attend_goal() {
    const Live::Goal& goal = live().goal();
    if (!goal.busy) {
      search_.reset();
    } else if (!search_ || searched_ != goal.number) {
      search_.reset();
      search_ = std::make_unique<ErrorSearch>(request_.scene, goal.asked, *environment_);
      searched_ = goal.number;
    } else if (const auto found = search_->found()) {
      live().choose(*found);
    }
  }

 private:
  void put_on(const SceneRequest& asked) {
    auto scene = std::make_unique<LoadedScene>(load(asked, *environment_, *registry_));
    if (!request_.compare.empty()) *scene = side_by_side(*scene, request_, *registry_);
    auto live = std::make_unique<Live>(*scene, asked, *registry_, number_++);
    if (!request_.compare.empty()) live->act_on_all();
    search_.reset();
    live_ = std::move(live);
    scene_ = std::move(scene);
    request_.scene = asked;
  }

  ViewRequest request_;
  const Environment* environment_ = nullptr;
  Registry* registry_ = nullptr;
  int number_ = 0;
  Live* lent_ = nullptr;
  std::unique_ptr<LoadedScene> scene_;
  std::unique_ptr<Live> live_;
  std::unique_ptr<ErrorSearch> search_;
  int searched_ = 0;  // the number of its goal
};

void announce(const std::string& address, BrowserLaunch* browser, Console& console) {
  const std::size_t colon = address.rfind(':') + 1;
  const std::string port = address.substr(colon, address.find('/', colon) - colon);
  console.out << address << '\n';
  console.err << "from elsewhere: ssh -L " << port << ":127.0.0.1:" << port
              << " HOST, then that address; Ctrl-C ends\n";
  flush_or_throw(console.out, "standard output");
  try {
    if (browser) browser->open(address);
  } catch (const Error& error) {  // a person can still open the address
    console.err << "sim: " << error.what() << '\n';
  }
}

using Caught = std::function<int()>;  // the signal that came, or 0

// The reason of a refusal goes to the client that sent the command.
void obey(Stage& stage, View& shown, const ViewMessage& command) {
  std::string refused = stage.live().take(command.from, command.text);
  if (const auto wish = stage.live().take_wish()) {
    try {
      stage.set(wish->name, wish->value);
      shown.renew(stage.live().scene());
    } catch (const Error& error) {
      refused = error.what();
    }
  }
  if (!refused.empty()) shown.refuse(command.from, refused);
}

// Until it is closed or a signal comes: served, stepped and shown.
void serve(Stage& stage, const Plugin<View>& plugin, const ViewRequest& request,
           const Caught& caught, Console& console) {
  ViewTask task{.scene = stage.live().scene(), .title = "sim " + request.scene.scene};
  task.token = random_token();
  task.nonce = random_token();
  task.port = request.port;
  task.pause_hidden = request.pause_hidden;
  const auto shown = made(plugin.make(Params(plugin.title(), plugin.params, {}, ""), task), plugin);
  BrowserLaunch browser;
  if (const std::string address = shown->address(); !address.empty())
    announce(address, request.open ? &browser : nullptr, console);
  const auto take = [&](const ViewMessage& command) { obey(stage, *shown, command); };
  const auto ready = [&] { return !caught() && !stage.live().travelling(); };
  CommandQueue commands(*shown, ready, take);
  auto next = Clock::now(), quiet = next;
  double drawn = 0;  // s that the last picture took
  while (!caught() && !shown->closed()) {
    commands.serve_until(next);
    browser.remove_when_old();
    stage.attend_goal();
    Live& live = stage.live();
    next = std::max(next + span(kFrame), Clock::now());
    // Slow drawing gives steps as much time as itself: pictures are left out, not steps.
    live.run(kStepShare * std::max(kFrame, std::min(drawn, kLongestSilence)));
    // A few frames are enough if nothing happens, for clients that missed the last one.
    const bool changed = live.fresh() || shown->touched();
    if (!shown->wants_frame() || (!changed && Clock::now() < quiet)) continue;
    quiet = Clock::now() + span(kQuiet);
    const Stopwatch watch;
    shown->show(live.moment(), live.state());
    drawn = watch.seconds();
  }
}

// Until Q or a signal.
void play_in_terminal(Live& live, const Caught& caught) {
  const Takeover takeover;
  TerminalFront front(live);
  std::string input;
  auto next = Clock::now(), next_picture = next;
  while (!caught() && !front.closed()) {
    const double left = std::chrono::duration<double>(next - Clock::now()).count();
    pollfd keys{0, POLLIN, 0};
    if (::poll(&keys, 1, static_cast<int>(std::max(0.0, 1000 * left))) > 0) {
      char bytes[4096];
      const ssize_t count = ::read(0, bytes, sizeof bytes);
      if (count <= 0) break;  // the terminal has gone
      input.append(bytes, static_cast<std::size_t>(count));
      for (const TerminalEvent& event : take_events(input)) front.take(event);
    }
    if (Clock::now() < next) continue;
    next = std::max(next + span(kFrame), Clock::now());
    live.run(kStepShare * kFrame);
    if (Clock::now() < next_picture) continue;
    next_picture = Clock::now() + span(2 * kFrame);
    put_control(std::cout, front.picture());
    std::cout.flush();
    std::cout.flush();
  }
}

// The screen of a scene: a missing one is reported before anything is loaded.
class Screen {
 public:
  Screen(const ViewRequest& request, Registry& registry)
      : request_(request),
        plugin_(request.terminal ? nullptr : &plugin_of(request.window, registry)) {
    if (const std::string why = no_pictures(); request.terminal && !why.empty())
      throw Error(ErrorKind::kIo, {"no pictures in this terminal", "sim view --terminal", why,
                                   "leave out --terminal"});
  }

  void show(Stage& stage, const Caught& caught, Console& console) const {
    if (plugin_)
      serve(stage, *plugin_, request_, caught, console);
    else
      play_in_terminal(stage.live(), caught);
  }

 private:
  const ViewRequest& request_;
  const Plugin<View>* plugin_;
};

}  // namespace

int view(const ViewRequest& request, const Environment& environment, Registry& registry,
         Console& console) {
  const Screen screen(request, registry);
  Stage stage(request, environment, registry);

  std::optional<report::RecordingFile> file;
  std::optional<RecordingWriter> writer;
  if (request.record) {
    FilePlan plan;
    plan_inputs(stage.spec(), registry, plan);
    plan.writes("--record", *request.record);
    plan.check();
    file.emplace(*request.record, [&](const std::string& why) { print_error(console.err, why); });
    writer.emplace([&file](std::string_view lines) { file->append(lines); },
                   report::recording_header(named_scene(request.scene)), stage.spec().world);
    stage.live().player().record(*writer);
  }

  const Interrupts interrupts;
  // Signals are asked for when the scene is on the screen: the recording begins.
  const auto caught = [&] {
    if (file) file->begin();
    return interrupts.caught();
  };
  screen.show(stage, caught, console);
  stage.live().player().end_record();
  if (interrupts.caught()) return 128 + interrupts.caught();
  return file ? file->finish() : 0;
}

void view_present(LoadedScene& scene, std::vector<Timeline>& timelines, const ViewRequest& request,
                  const std::vector<RecordingWriter*>& writers, const Environment& environment,
                  Registry& registry, Console& console, const std::function<int()>& caught) {
  const Screen screen(request, registry);
  Live live(scene, request.scene, registry, 0, std::move(timelines));
  struct GiveBack {
    Live& live;
    std::vector<Timeline>& to;
    ~GiveBack() { to = live.player().take_timelines(); }
  } const give_back{live, timelines};
  for (RecordingWriter* writer : writers) live.player().record(*writer);
  live.take(0, "pause");
  Stage stage(live, request, environment);
  screen.show(stage, caught, console);
}

}  // namespace sim::cli
