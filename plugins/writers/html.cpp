// One page that shows a run in any browser: no network, no library.
#include <iostream>

#include "core/base/error.h"
#include "core/output/output.h"
#include "core/output/page/page.h"
#include "core/output/writer.h"
#include "core/picture/quantity.h"
#include "core/plugin/plugin.h"

namespace {

constexpr std::size_t kMostBytes = 50'000'000;

class Html final : public sim::Writer {
 public:
  explicit Html(const sim::WriterTask& task) : task_(task), output_({task.file}, std::cout) {}

  sim::Pace pace() const override { return sim::Pace::kFilm; }

  void add(const sim::Moment& moment) override {
    moments_.push_back(moment);
    const std::string& colour = task_.look.colour;
    for (std::size_t m = 0; m < moment.size(); ++m) {
      sim::Frame& frame = moments_.back()[m];
      if (colour == "energy") frame.values = sim::quantity(task_.models[m], frame, colour);
      frame.v = {};
    }
  }

  void commit() override {
    if (moments_.empty()) return;
    std::string page = sim::Page(task_.models, moments_, task_.look).of_run();
    if (page.size() > kMostBytes)
      throw sim::Error(sim::ErrorKind::kIo,
                       {"a page too large for a browser", task_.file,
                        std::to_string(page.size() / 1'000'000) + " MB, of at most 50",
                        "fewer moments, --fps 10, or a shorter --time"});
    output_.buffer() = std::move(page);
    output_.commit();
  }

 private:
  sim::WriterTask task_;
  sim::Output output_;
  std::vector<sim::Moment> moments_;
};

}  // namespace

SIM_PLUGIN(Writer, "html") {
  registrar.add(sim::Plugin<sim::Writer>{
      {.name = "html",
       .summary = "a page for any browser: play, scrub, turn, pick a particle, energies",
       .formula = "--out run.html --fps 30"},
      [](const sim::Params&, const sim::WriterTask& task) {
        return std::make_unique<Html>(task);
      }});
}
