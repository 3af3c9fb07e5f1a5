// A view of a running scene, through which a user acts on it: a served page, a window. Each is a
// plugin, opened on demand. It receives a scene once, then moments of it, and returns words.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/picture/look.h"
#include "core/picture/model.h"

namespace sim {

// The constant part of a scene, valid until renew(), when the objects that it points to may be
// gone.
struct ViewScene {
  int number = 0;      // a scene that comes later has another one
  bool world = false;  // words begin with the name of their system
  std::span<const Model> models{};
  std::span<const Moment> preview{};  // of later times, for the first camera
  Look look{};
  std::vector<std::string> methods{};  // names of integrators
  std::vector<SceneArg> args{};        // parameters of the scene
};

struct ViewTask {
  ViewScene scene{};
  std::string title{};
  std::string token{};        // required in an address: letters and digits
  std::string nonce{};        // of the page's own script: letters and digits, random
  int port = 0;               // 0: one that is free
  bool pause_hidden = false;  // while no eye is on it, it pauses
};

struct EnergySample {
  std::int64_t step = 0;
  double t = 0;                                  // s
  double kinetic = 0, potential = 0, drift = 0;  // J
};

// The state of one system; `share` is the step as a share of the largest stable one, or not a
// number.
struct ViewSystem {
  EnergySample now{};
  double h = 0, share = std::nan("");  // s
  std::string method{}, verdict{};
  std::vector<int> pinned{}, held{};
  std::vector<std::pair<std::string, bool>> switches{};
  std::string hash{};  // while it pauses
};

// An error that was asked for instead of a step.
struct ViewGoal {
  bool open = false;    // one can be asked for
  bool busy = false;    // a method and a step that keep it are looked for
  std::string asked{};  // "1%", or "" for none
  std::string words{};  // what was chosen, or why nothing was
};

struct ViewState {
  int number = 0;  // of the scene
  bool playing = true, slow = false;
  double speed = 1, real = 0;            // of real time: wanted, and reached
  double us = 0;                         // microseconds a step
  double known = 0;                      // s, as far as it has been
  std::string failure{};                 // why it stopped
  std::string measured{};                // `values` of the frames: energy, error, mode, or ""
  std::vector<ViewSystem> systems{};     // as the models
  std::span<const EnergySample> past{};  // of the first system that has energies
  ViewGoal goal{};
};

// A message of a user, and the number of the connection that sent it. Words are actions as in
// recordings; "pull I X Y Z" of a held particle, in m; play, pause, speed S, step N, back N, goto
// T, undo, reset, set NAME VALUE, colour NAME, error E or off, and "bye" of a client that leaves.
struct ViewMessage {
  std::uint64_t from = 0;
  std::string text;
};

// Only wait() blocks, and no input from outside throws.
class View {
 public:
  static constexpr std::size_t kMostText = 4096;  // bytes of a message; longer ones end its sender

  virtual ~View() = default;

  virtual std::string address() const { return ""; }  // to be opened by a person, if it is one

  // Serves pending requests, for at most so many milliseconds; returns the messages received.
  virtual std::vector<ViewMessage> wait(int milliseconds) = 0;
  // While on hold, wait() need not return messages: they may stay with their senders.
  virtual void hold(bool) {}
  virtual bool closed() const { return false; }  // nobody will look again

  // A moment is drawn, or sent to all clients that have received their last one.
  virtual bool wants_frame() const { return true; }
  virtual bool touched() const { return false; }  // wants one although nothing happened
  virtual void show(const Moment& moment, const ViewState& state) = 0;
  virtual void refuse(std::uint64_t to, const std::string& why) = 0;  // its last message
  virtual void renew(const ViewScene& scene) = 0;                     // another one from now on
};

}  // namespace sim
