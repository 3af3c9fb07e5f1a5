// A window on this machine, by GLFW, OpenGL and Dear ImGui: the picture, a panel and the energies.
#define GLFW_INCLUDE_NONE  // OpenGL is epoxy's
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <map>
#include <memory>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/front.h"
#include "core/output/view.h"
#include "core/picture/raster/text.h"
#include "core/plugin/plugin.h"
#include "plugins/view/energy_strip.h"
#include "plugins/view/gl_picture.h"

namespace {

constexpr int kWidth = 1180, kHeight = 720;  // of a new window
constexpr float kStrip = 110;                // of the energies, below
constexpr float kPanel = 250;
constexpr float kReach = 8;      // pixels, beside a particle
constexpr double kDouble = 0.3;  // s between two clicks that are one
constexpr int kSettle = 3;       // pictures until a panel has found its form
constexpr std::uint64_t kHere = 1;
const ImVec4 kBad{0.70F, 0.15F, 0.12F, 1}, kInk{0.17F, 0.20F, 0.23F, 1};

[[noreturn]] void no_window(const std::string& why) {
  throw sim::Error(sim::ErrorKind::kIo,
                   {"no window", "sim view --window", why,
                    "leave out --window: the page and --terminal need no screen here"});
}

std::string percent(double share) {
  if (std::isnan(share)) return "-";
  return share > 10 ? "> 1000 %" : sim::brief(100 * share, 2) + " %";
}

class Window final : public sim::View {
 public:
  explicit Window(const sim::ViewTask& task);
  ~Window() override { close(); }

  std::vector<sim::ViewMessage> wait(int milliseconds) override;
  bool closed() const override { return front_.closed() || glfwWindowShouldClose(window_); }
  bool touched() const override { return touched_ > 0; }
  void show(const sim::Moment& moment, const sim::ViewState& state) override;
  void refuse(std::uint64_t, const std::string& why) override { refused_ = why; }
  void renew(const sim::ViewScene& scene) override;

 private:
  static Window& of(GLFWwindow* window) {
    return *static_cast<Window*>(glfwGetWindowUserPointer(window));
  }
  void listen();
  void close();
  void say(const std::string& words) { said_.push_back({kHere, words}); }
  void take(const sim::FrontEvent& event);
  void typed(const std::string& key);
  void button(int button, int action, int mods);
  void draw();
  void words(const sim::Picture& picture, float height);
  void panel(float height);
  void method_and_step(const sim::ViewSystem& system, const std::string& whose);
  void figures(const sim::ViewSystem& system);
  void switches();
  void args();
  void number(const sim::SceneArg& arg, double first, double& now);
  void help();

  sim::ViewTask task_;
  sim::Front front_;
  GLFWwindow* window_ = nullptr;
  std::unique_ptr<GlPicture> drawing_;
  sim::ViewState state_;
  std::vector<sim::EnergySample> past_;
  std::vector<sim::ViewMessage> said_;
  std::map<std::string, double> sliders_;
  std::map<std::string, std::array<char, 256>> texts_;
  std::string refused_;
  double last_press_ = 0;
  int touched_ = kSettle;  // pictures that are due, whatever happens in the scene
};

Window::Window(const sim::ViewTask& task) : task_(task), front_(task.scene, kReach) {
  std::string why = "there is no screen: DISPLAY and WAYLAND_DISPLAY are not set";
  if (!glfwInit()) {
    const char* text = nullptr;
    if (glfwGetError(&text) != GLFW_NO_ERROR && text) why = text;
    no_window(why);
  }
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_SAMPLES, 4);
  glfwWindowHint(GLFW_STENCIL_BITS, 8);
  window_ = glfwCreateWindow(kWidth, kHeight, task.title.c_str(), nullptr, nullptr);
  if (!window_) {
    glfwTerminate();
    no_window("the screen has no OpenGL 3.3");
  }
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(0);
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  ImGui::StyleColorsLight();
  ImGui::GetStyle().WindowRounding = 6;
  ImGui::GetStyle().Colors[ImGuiCol_Text] = kInk;
  listen();  // before ImGui, which chains the earlier callbacks
  ImGui_ImplGlfw_InitForOpenGL(window_, true);
  ImGui_ImplOpenGL3_Init("#version 330");
  try {
    drawing_ = std::make_unique<GlPicture>();
  } catch (...) {
    close();
    throw;
  }
}

void Window::close() {
  drawing_.reset();
  if (!window_) return;
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window_);
  glfwTerminate();
  window_ = nullptr;
}

// --- Keys and mouse -----------------------------------------------------------------------------

void Window::listen() {
  glfwSetWindowUserPointer(window_, this);
  glfwSetCharCallback(window_, [](GLFWwindow* w, unsigned code) {
    if (code > 32 && code < 127) of(w).typed(std::string(1, static_cast<char>(code)));
    if (code == 32) of(w).typed("Space");
  });
  glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int) {
    static const std::map<int, const char*> kNamed{{GLFW_KEY_LEFT, "Left"},
                                                   {GLFW_KEY_RIGHT, "Right"},
                                                   {GLFW_KEY_HOME, "Home"},
                                                   {GLFW_KEY_ESCAPE, "Esc"}};
    const auto named = kNamed.find(key);
    if (action != GLFW_RELEASE && named != kNamed.end()) of(w).typed(named->second);
  });
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int which, int action, int mods) {
    of(w).button(which, action, mods);
  });
  glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double, double) {
    of(w).take({.what = sim::FrontEvent::What::kMove});
  });
  glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double dy) {
    of(w).touched_ = kSettle;
    if (!ImGui::GetIO().WantCaptureMouse)
      of(w).front_.zoom(std::pow(0.9F, static_cast<float>(std::clamp(dy, -20.0, 20.0))));
  });
  glfwSetWindowRefreshCallback(window_, [](GLFWwindow* w) { of(w).touched_ = kSettle; });
}

// In pixels of the frame buffer, where the pointer is now.
void Window::take(const sim::FrontEvent& event) {
  double x = 0, y = 0;
  int width = 1, height = 1, pixels = 1, rows = 1;
  glfwGetCursorPos(window_, &x, &y);
  glfwGetWindowSize(window_, &width, &height);
  glfwGetFramebufferSize(window_, &pixels, &rows);
  sim::FrontEvent placed = event;
  placed.x = static_cast<float>(x * pixels / std::max(1, width));
  placed.y = static_cast<float>(y * rows / std::max(1, height));
  for (const std::string& words : front_.take(placed)) say(words);
  touched_ = kSettle;
}

void Window::typed(const std::string& key) {
  if (ImGui::GetIO().WantTextInput) return;
  refused_.clear();
  take({.what = sim::FrontEvent::What::kKey, .key = key});
}

void Window::button(int which, int action, int mods) {
  using What = sim::FrontEvent::What;
  sim::FrontEvent event;
  event.what = action == GLFW_PRESS ? What::kPress : What::kRelease;
  event.moves = which != GLFW_MOUSE_BUTTON_LEFT;
  event.shift = (mods & GLFW_MOD_SHIFT) != 0;
  event.control = (mods & GLFW_MOD_CONTROL) != 0;
  if (action == GLFW_PRESS && ImGui::GetIO().WantCaptureMouse) {
    touched_ = kSettle;
    return;
  }
  take(event);
  if (action != GLFW_PRESS || event.moves) return;
  const double now = glfwGetTime();
  if (now - std::exchange(last_press_, now) < kDouble) take({.what = What::kLook});
}

std::vector<sim::ViewMessage> Window::wait(int milliseconds) {
  if (milliseconds > 0 && said_.empty())
    glfwWaitEventsTimeout(milliseconds / 1000.0);
  else
    glfwPollEvents();
  return std::exchange(said_, {});
}

// --- What is seen -------------------------------------------------------------------------------

void Window::renew(const sim::ViewScene& scene) {
  task_.scene = scene;
  front_.renew(scene);
  sliders_.clear();
  texts_.clear();
  state_.systems.clear();
}

void Window::show(const sim::Moment& moment, const sim::ViewState& state) {
  front_.show(moment, state);
  state_ = state;
  past_.assign(state.past.begin(), state.past.end());
  draw();
}

void Window::draw() {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  touched_ = std::max(0, touched_ - 1);
  if (width < 2 || height < 2) return;
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float scale = static_cast<float>(height) / size.y;
  const float strip_height = past_.size() > 1 ? std::min(kStrip, size.y / 3) : 0;
  const int above = std::max(1, height - static_cast<int>(strip_height * scale));
  front_.resize(width, above);
  const sim::Picture picture = front_.picture();
  glViewport(0, 0, width, height);
  glClearColor(1, 1, 1, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  drawing_->draw(picture, 0, height - above, width, above);
  words(picture, static_cast<float>(above) / scale);
  panel(size.y - strip_height);
  if (strip_height > 0) {
    const double now = state_.systems.empty() ? 0 : state_.systems[front_.chosen()].now.t;
    if (const auto t = energy_strip(past_, now, size.x, size.y - strip_height))
      say("goto " + sim::shortest(*t));
  }
  if (front_.help()) help();
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  glfwSwapBuffers(window_);
}

// The words of the picture, and what was refused.
void Window::words(const sim::Picture& picture, float height) {
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const float scale = sim::raster::text_scale(static_cast<int>(height)),
              font = ImGui::GetFontSize();
  for (const sim::PicturePatch& patch : picture.patches) {
    const float step = patch.width / static_cast<float>(std::max<std::size_t>(1, patch.rgb.size()));
    for (std::size_t i = 0; i < patch.rgb.size(); ++i) {
      const float left = patch.x + step * static_cast<float>(i);
      list.AddRectFilled({scale * left, scale * patch.y},
                         {scale * (left + step) + 1, scale * (patch.y + patch.height)},
                         tint(patch.rgb[i], patch.opacity));
    }
  }
  for (const sim::PictureText& text : picture.texts) {
    const float wide = ImGui::CalcTextSize(text.text.c_str()).x;
    const float x = scale * text.x - static_cast<float>(text.align) * wide / 2;
    list.AddText({x, scale * text.y - font + 2}, tint(text.rgb), text.text.c_str());
    if (text.bold)
      list.AddText({x + 1, scale * text.y - font + 2}, tint(text.rgb), text.text.c_str());
  }
  if (refused_.empty()) return;
  const ImVec2 wide = ImGui::CalcTextSize(refused_.c_str(), nullptr, false, 700);
  list.AddRectFilled({20, height - wide.y - 28}, {44 + wide.x, height - 12}, tint(0xB3261E), 6);
  list.AddText(nullptr, 0, {32, height - wide.y - 20}, tint(0xFFFFFF), refused_.c_str(), nullptr,
               700);
}

void Window::panel(float height) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({size.x - kPanel - 14, 12}, ImGuiCond_Always);
  ImGui::SetNextWindowSizeConstraints({kPanel, 0}, {kPanel, std::max(60.0F, height - 24)});
  ImGui::Begin(
      "panel", nullptr,
      ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize);
  ImGui::PushItemWidth(130);
  if (!state_.systems.empty()) {
    const sim::ViewSystem& system = state_.systems[front_.chosen()];
    const std::string whose = front_.name(front_.chosen());
    if (ImGui::Button(state_.playing ? "Pause" : "Play", {70, 0}))
      say(state_.playing ? "pause" : "play");
    ImGui::SameLine();
    ImGui::Text("t = %.3f s", system.now.t);
    method_and_step(system, whose);
    figures(system);
    switches();
    args();
    const std::string& verdict = state_.failure.empty() ? system.verdict : state_.failure;
    const bool bad = verdict.starts_with("suspect") || verdict.starts_with("diverged");
    ImGui::PushStyleColor(ImGuiCol_Text, bad ? kBad : kInk);
    ImGui::PushTextWrapPos(kPanel - 10);
    ImGui::TextUnformatted(verdict.c_str());
    ImGui::PopTextWrapPos();
    ImGui::PopStyleColor();
    ImGui::TextDisabled("? shows the keys");
  }
  ImGui::PopItemWidth();
  ImGui::End();
}

void Window::method_and_step(const sim::ViewSystem& system, const std::string& whose) {
  const std::string name = system.method.substr(0, system.method.find(':'));
  if (ImGui::BeginCombo("integrator", system.method.c_str())) {
    for (const std::string& each : task_.scene.methods)
      if (ImGui::Selectable(each.c_str(), each == name)) say(whose + "integrator " + each);
    ImGui::EndCombo();
  }
  double h = 1000 * system.h;
  ImGui::PushItemWidth(76);
  if (ImGui::InputDouble("##h", &h, 0, 0, "%.5g", ImGuiInputTextFlags_EnterReturnsTrue))
    say(whose + "dt " + sim::shortest(h / 1000));
  ImGui::PopItemWidth();
  for (const auto& [label, factor] : {std::pair{"/2", 0.5}, {"x2", 2.0}}) {
    ImGui::SameLine(0, 4);
    if (ImGui::Button(label)) say(whose + "dt " + sim::shortest(system.h * factor));
  }
  ImGui::SameLine();
  ImGui::TextUnformatted("step, ms");
}

void Window::figures(const sim::ViewSystem& system) {
  const auto row = [](const char* name, const std::string& value, bool bad = false) {
    ImGui::TextUnformatted(name);
    ImGui::SameLine(kPanel - 14 - ImGui::CalcTextSize(value.c_str()).x);
    ImGui::TextColored(bad ? kBad : kInk, "%s", value.c_str());
  };
  row("of the largest stable", percent(system.share), system.share > 1);
  row("energy drift", sim::brief(system.now.drift, 2) + " J",
      system.verdict.starts_with("suspect: energy"));
  row("a step", sim::brief(state_.us, 3) + " us");
  row("of real time",
      state_.playing ? sim::brief(state_.real, 2) + (state_.slow ? " x: too slow" : " x")
                     : "paused",
      state_.slow);
}

void Window::switches() {
  for (std::size_t i = 0; i < state_.systems.size(); ++i)
    for (const auto& [name, on] : state_.systems[i].switches) {
      bool now = on;
      if (ImGui::Checkbox((front_.name(i) + name).c_str(), &now))
        say(front_.name(i) + "switch " + name + (now ? " on" : " off"));
    }
}

// Parameters of the scene, which begins anew with another value.
void Window::args() {
  for (const sim::SceneArg& arg : task_.scene.args) {
    if (const auto* first = std::get_if<double>(&arg.default_value); first && *first != 0) {
      const auto* value = std::get_if<double>(&arg.value);
      number(arg, *first, sliders_.try_emplace(arg.name, value ? *value : *first).first->second);
    } else if (const auto* flag = std::get_if<bool>(&arg.value)) {
      bool now = *flag;
      if (ImGui::Checkbox(arg.name.c_str(), &now))
        say("set " + arg.name + (now ? " true" : " false"));
    } else {
      auto [text, fresh] = texts_.try_emplace(arg.name);
      if (fresh) sim::to_text(arg.value).copy(text->second.data(), text->second.size() - 1);
      if (ImGui::InputText(arg.name.c_str(), text->second.data(), text->second.size(),
                           ImGuiInputTextFlags_EnterReturnsTrue))
        say("set " + arg.name + " " + text->second.data());
    }
    if (!arg.doc.empty() && ImGui::IsItemHovered()) ImGui::SetTooltip("%s", arg.doc.c_str());
  }
}

// From a tenth of what the scene says to ten times that; whole where that is.
void Window::number(const sim::SceneArg& arg, double first, double& now) {
  const bool whole = first == std::floor(first) && std::abs(first) > 1;
  const double low = first / 10, high = first * 10;
  ImGui::SliderScalar(arg.name.c_str(), ImGuiDataType_Double, &now, &low, &high,
                      whole ? "%.0f" : "%.3g", ImGuiSliderFlags_Logarithmic);
  if (!ImGui::IsItemDeactivatedAfterEdit()) return;
  if (whole) now = std::round(now);
  say("set " + arg.name + " " + (whole ? sim::shortest(now) : sim::brief(now, 3)));
}

void Window::help() {
  ImGui::SetNextWindowPos({22, 90}, ImGuiCond_Always);
  ImGui::Begin("keys", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize);
  for (const sim::FrontKey& each : sim::Front::keys()) {
    ImGui::TextUnformatted(each.keys);
    ImGui::SameLine(110);
    ImGui::TextUnformatted(each.does);
  }
  ImGui::End();
}

}  // namespace

SIM_PLUGIN(View, "window") {
  registrar.add(
      sim::Plugin<sim::View>{{.name = "window",
                              .summary = "a window: what the page shows and does, through OpenGL",
                              .formula = "sim view SCENE --window"},
                             [](const sim::Params&, const sim::ViewTask& task) {
                               return std::make_unique<Window>(task);
                             }});
}
