// One page that shows a run in any browser: no network, no library.
#include <iostream>

#include "core/base/error.h"
#include "core/output/output.h"
#include "core/output/page/page.h"
#include "core/output/stored_moments.h"
#include "core/output/writer.h"
#include "core/plugin/plugin.h"

namespace {

constexpr std::size_t kMostBytes = 50'000'000;

class Html final : public sim::Writer {
 public:
  explicit Html(const sim::WriterTask& task)
      : task_(task), output_({task.file}, std::cout), moments_(task.file) {}

  sim::CostEstimate pace() const override { return sim::CostEstimate::kFilm; }

  void add(const sim::Moment& moment) override {
    sim::Moment kept = moment;
    const std::string& colour = task_.look.colour;
    for (std::size_t m = 0; m < moment.size(); ++m) {
      if (colour == "energy") kept[m].values = sim::quantity(task_.models[m], kept[m], colour);
      kept[m].v = {};
    }
    moments_.add(kept);
  }

  void commit() override {
    if (moments_.size() == 0) return;
    std::string page = sim::Page(task_.models, moments_, task_.look).of_run(kMostBytes);
    if (page.empty() || page.size() > kMostBytes)
      throw sim::Error(sim::ErrorKind::kIo,
                       {"a page too large for a browser", task_.file, "it would have above 50 MB",
                        "fewer moments, --fps 10, or a shorter --time"});
    output_.buffer() = std::move(page);
    output_.commit();
  }

 private:
  sim::WriterTask task_;
  sim::Output output_;
  sim::StoredMoments moments_;
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
