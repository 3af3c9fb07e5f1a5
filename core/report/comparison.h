// The same system side by side with several methods, each with its cost and its error against a
// reference.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/picture/gallery.h"
#include "core/study/accuracy/reference.h"
#include "core/study/problem.h"

namespace sim::report {

struct ComparedMethod {
  MethodChoice integrator = {};  // no name: the scene's own
  double dt = 0;                 // s; 0: the scene's own
};

struct ComparisonTask {
  study::Problem problem;  // its options are those of a run
  std::string name;        // of the scene, for the table
  std::vector<ComparedMethod> methods =
      {};                           // 16 at most; empty: the scene's own and some known ones
  std::optional<double> time = {};  // s; nothing = the scene's duration
  std::string of = {};              // an observable, or a figure of it, to be compared, too
  double fps = 30;                  // pictures a second of films
  // The run that errors are taken against, instead of a reference with an error of its own.
  std::optional<ComparedMethod> reference = {};
};

class Comparison {
 public:
  // Throws Error{kUsage} for methods that cannot be compared.
  explicit Comparison(ComparisonTask task);
  ~Comparison();
  Comparison(const Comparison&) = delete;
  Comparison& operator=(const Comparison&) = delete;

  // Returns false if it was told to end; the functions below need a complete comparison.
  bool run(const study::Watch& watch);

  // Each file gets a panel of each method at equal times, coloured by the error unless the look has
  // another colour. Throws the errors of writers.
  void write(const std::vector<std::string>& files, const LookSpec& look,
             const std::function<bool()>& stop) const;
  std::string table() const;
  // {"system","time","size","frames","reference":{"how","error"},"judged":{"of","figure","error"},
  //  "methods":[{"integrator","dt","steps","evaluations","seconds","error","error_end","most",
  //              "judged","off","diverged_at"}]}: times in s, errors in m.
  std::string json() const;

 private:
  struct Runner;

  std::vector<ComparedMethod> methods() const;
  Runner runner(const ComparedMethod& method) const;
  void choose_frames();
  bool step(Runner& runner, double end, const std::function<bool()>& go_on) const;
  Frame frame_at(Runner& runner, double t) const;
  study::Reference reference_run(const study::Watch& watch) const;
  void measure(Runner& runner, Frame& frame, std::size_t point);
  double figure_of(const Runner& runner, const std::function<bool()>& go_on) const;
  Moment stage(std::size_t point, const Frame& like) const;
  std::string unit() const { return model_.second_order ? "m" : ""; }
  std::string amount(double value) const;

  ComparisonTask task_;
  const SystemSpec& spec_;
  double time_;  // s
  std::optional<study::Quantity> of_;
  Model model_;
  std::vector<Runner> runners_;
  study::Reference reference_, judged_;  // of positions, and of the quantity
  std::size_t stride_ = 1;               // points of the reference a frame
  double size_ = 1;                      // of the scene
  std::vector<Moment> stage_;
};

}  // namespace sim::report
