// The verbs that run a scene repeatedly: their options and requests.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "cli/command_line/out_options.h"
#include "cli/verbs/compare.h"
#include "cli/verbs/order.h"
#include "cli/verbs/stability.h"
#include "cli/verbs/sweep.h"
#include "cli/verbs/tradeoff.h"

namespace sim::cli {

// The options of a run that studies accept.
struct StudyBase {
  SceneRequest scene;                         // without the name of the scene
  std::vector<std::string> integrators, dts;  // -i, -d: as often as they are given
  std::string time;
  OutTexts out;
  std::string tol{}, steps{}, check{};
  std::vector<std::string> of{};
  bool verify = true;
  bool json = false;
  ShowProgress progress = ShowProgress::kAuto;
};

class StudyOptions {
 public:
  // Adds their subcommands, in the order of the help.
  void add_to(CLI::App& app);

  bool has(const CLI::App* verb) const { return taken_.contains(verb); }
  // True for an option of a run that the verb takes, as "--time".
  bool takes(const CLI::App* verb, const std::string& option) const;

  // The request of one of these verbs. Throws Error{kUsage}.
  using Request =
      std::variant<StabilityRequest, OrderRequest, TradeoffRequest, CompareRequest, SweepRequest>;
  Request request(const CLI::App* verb, const StudyBase& base) const;

 private:
  StabilityRequest stability(const StudyBase& base) const;
  OrderRequest order(const StudyBase& base) const;
  TradeoffRequest tradeoff(const StudyBase& base) const;
  CompareRequest compare(const StudyBase& base) const;
  SweepRequest sweep(const StudyBase& base) const;
  CLI::App* study(CLI::App& app, const std::string& name, const std::string& doc,
                  const std::string& footer, const std::set<std::string>& taken);
  void scene_of(CLI::App* verb);
  SceneRequest named_scene(const StudyBase& base) const;    // by the verb's own argument
  SceneRequest stepped_scene(const StudyBase& base) const;  // with one --integrator and --dt
  void budget_of(CLI::App* verb, const std::string& doc);

  std::string scene_, at_, integrators_, budget_, csv_, svg_;
  std::string words_[2];  // of sim order
  std::vector<std::string> over_;
  std::string cases_, part_, timeout_;
  bool extremes_ = false, list_ = false, collect_ = false, keep_failed_ = false;
  CLI::App *stability_ = nullptr, *order_ = nullptr, *tradeoff_ = nullptr, *compare_ = nullptr,
           *sweep_ = nullptr;
  std::map<const CLI::App*, std::set<std::string>> taken_;
};

}  // namespace sim::cli
