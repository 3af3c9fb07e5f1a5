// Extended XYZ: particles as OVITO and ASE read them, 17 digits where they are needed.
#include <iostream>

#include "core/base/text.h"
#include "core/output/output.h"
#include "core/output/writer.h"
#include "core/plugin/plugin.h"

namespace {

class Xyz final : public sim::Writer {
 public:
  explicit Xyz(const sim::WriterTask& task) : task_(task), output_({task.file}, std::cout) {}

  sim::CostEstimate pace() const override { return sim::CostEstimate::kFilm; }

  // Systems of a world are one frame; `system` counts them, `id` is that in the system.
  void add(const sim::Moment& moment) override {
    std::size_t count = 0;
    for (const sim::Frame& frame : moment) count += frame.x.size() / 3;
    std::string& out = output_.buffer();
    out += std::to_string(count) +
           "\nProperties=species:S:1:pos:R:3:velo:R:3:mass:R:1:id:I:1:system:I:1 Time=";
    sim::append_number(out, moment.front().t);
    out += " Step=" + std::to_string(moment.front().step) + " pbc=\"F F F\"\n";
    for (std::size_t m = 0; m < moment.size(); ++m) {
      const sim::Frame& frame = moment[m];
      for (std::size_t i = 0; i < frame.x.size() / 3; ++i) {
        out += "H";
        for (std::size_t c = 0; c < 3; ++c) append(frame.x[3 * i + c]);
        for (std::size_t c = 0; c < 3; ++c) append(frame.v.empty() ? 0 : frame.v[3 * i + c]);
        append(task_.models[m].mass.empty() ? 1 : task_.models[m].mass[i]);
        out += " " + std::to_string(i) + " " + std::to_string(m) + "\n";
        output_.flush_if_full();
      }
    }
  }

  void commit() override { output_.commit(); }

 private:
  void append(double value) {
    output_.buffer() += ' ';
    sim::append_number(output_.buffer(), value);
  }

  sim::WriterTask task_;
  sim::Output output_;
};

}  // namespace

SIM_PLUGIN(Writer, "xyz") {
  registrar.add(sim::Plugin<sim::Writer>{
      {.name = "xyz",
       .summary = "extended XYZ for OVITO and ASE: positions, velocities, masses, time",
       .formula = "Properties=species:S:1:pos:R:3:velo:R:3:mass:R:1:id:I:1:system:I:1"},
      [](const sim::Params&, const sim::WriterTask& task) { return std::make_unique<Xyz>(task); }});
}
