// One case of a sweep: the run that its values define, and its row with the verdict.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/report/sweep_cases.h"
#include "core/study/run/run_length.h"
#include "core/study/run/track.h"
#include "core/study/study.h"
#include "core/study/verdict/verdict.h"

namespace sim::report {

// The values of a run that a case may change.
struct CaseValues {
  std::map<std::string, std::string> settings = {};  // parameters of the scene
  MethodChoice integrator = {};                      // without a name: the scene's own
  double dt = 0;                                     // s; 0 = the scene's own
  std::uint64_t seed = 0;
  study::RunLength length = {};
};

// `values` with those of case `index`. Throws Error{kUsage} for a text that is no value.
CaseValues values_of(const SweepCases& cases, std::size_t index, CaseValues values);

// Throws Error{kUsage} for a name that is neither an option nor a parameter of the scene, and for a
// world.
void check_cases(const SweepCases& cases, const SceneSpec& scene, const std::string& name);

// The names of all that the scene observes, and these figures of it.
std::vector<std::string> observed_columns(const SystemSpec& system,
                                          const std::vector<std::string>& of);

// The columns of a case after its values and before its observables; the last one is "seconds".
const std::vector<std::string>& case_columns();

struct CaseTask {
  study::RunLength length;
  std::vector<std::string> of, observed;  // figures; observed_columns()
  bool verify = true;                     // a second run with half the step
  std::function<bool()> stop;             // not empty; asked in between
  // Called with the verdict; an Error that it throws is the outcome of the case. May be empty.
  std::function<void(const study::Verdict&, const std::string& system)> check = {};
};

// The run of a case of the scene's first system. Throws Error.
class JudgedCase {
 public:
  JudgedCase(StudiedScene& scene, Registry& registry, CaseTask task);

  void run();
  std::vector<std::string> row(double seconds);  // the fields of these columns, after run()

 private:
  CaseTask task_;
  study::Track track_;
};

// The row of a case that is run alone.
std::vector<std::string> run_case(StudiedScene& scene, Registry& registry, const CaseTask& task);

std::string in_one_line(std::string text);  // control characters become spaces

// The fields of a case that ended otherwise, with its exit code and the reason.
std::vector<std::string> lost_case(int exit, const std::string& reason, std::size_t observed);

// {"case":3,"n":8,"integrator":"rk4","exit":0,"verdict":"trusted",..}: an empty field is null.
std::string case_json(const SweepCases& cases, std::size_t index,
                      const std::vector<std::string>& observed,
                      const std::vector<std::string>& fields);

}  // namespace sim::report
