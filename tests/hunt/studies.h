// Claims of studies on random scenes of every kind, each checked against runs.
#pragma once

#include <iosfwd>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/hunt/kind_runs.h"
#include "tests/hunt/random_numbers.h"

namespace sim_test {

// The outcome of the claims of one study.
struct ClaimTally {
  int held = 0, wrong = 0;
  int unknown = 0;    // the references do not agree well enough to judge them
  int refused = 0;    // scenes that the study says it cannot do
  int set_aside = 0;  // scenes that took too long
};

// One random scene, and the checks of what each study says of it.
class StudiedScene {
 public:
  StudiedScene(std::uint64_t seed, sim::Registry& registry, std::map<std::string, ClaimTally>& all,
               std::ostream& out);
  ~StudiedScene();
  StudiedScene(const StudiedScene&) = delete;
  StudiedScene& operator=(const StudiedScene&) = delete;

  // Each adds to the tally of its study; what is wrong goes to the stream.
  void check_tradeoff();
  void check_order();
  void check_compare();
  void check_stability();
  void check_minimal();
  void check_rest();
  void check_sweep();
  void claim(bool held, const std::string& words);  // about the study asked last

 private:
  // The answer of `sim STUDY SCENE WORDS --json`; empty if it was set aside or refused.
  std::optional<Json> ask(const std::string& study, const std::vector<std::string>& words);
  std::optional<std::string> answer(const std::string& study,
                                    const std::vector<std::string>& words);
  ClaimTally& tally() { return all_[study_]; }

  const Motion* motion(double time);  // of free coordinates; null where it is not known
  SeenCourse run(const sim::RunOptions& options, double time) const;
  sim::RunOptions options(const std::string& method, double dt, double tolerance) const;
  std::vector<std::string> some_methods(int count);

  struct PointCheck {
    double error = 0, unknown = 0;  // the true one, the largest of all looks that are known
    double seconds = 0;
    std::int64_t evaluations = 0;
    bool known = false;
  };
  // A run of a method against the errors that a study claims of it.
  PointCheck check_point(const std::string& name, const Json& point, double time, double until,
                         double reference_error, double size);
  void check_slope(const Json& method, double time, double reference_error, double size);
  bool rises_from_rest(sim::Simulation& system, const sim::SystemSpec& spec);

  std::uint64_t seed_;
  sim::Registry& registry_;
  std::map<std::string, ClaimTally>& all_;
  std::ostream& out_;
  Random random_;
  std::string kind_, text_, file_, study_;
  sim::SystemSpec spec_;
  std::vector<std::string> methods_;
  std::map<double, std::optional<Motion>> motions_;
};

// Runs `sim` with these words for some seconds of the processor at most.
Outcome limited_run(const std::vector<std::string>& words);

// Words: [N [SEED]]. 0 if no claim is wrong.
int hunt_studies(std::span<char* const> words);

}  // namespace sim_test
