// Tables of states: the rows of --dump, at the moments of --out.
#include <iostream>

#include "core/base/text.h"
#include "core/output/format.h"
#include "core/output/output.h"
#include "core/output/writer.h"
#include "core/plugin/plugin.h"

namespace {

class Table final : public sim::Writer {
 public:
  explicit Table(const sim::WriterTask& task)
      : task_(task), json_(task.format == "jsonl"), output_({task.file}, std::cout) {
    bool moves = false, points = false;
    for (const sim::Model& model : task.models) {
      moves = moves || model.second_order;
      points = points || !model.flat;
    }
    columns_ = moves ? 6 : points ? 3 : 1;
    if (json_) return;
    output_.buffer() += task.world ? "system,step,t" : "step,t";
    output_.buffer() += columns_ == 1 ? ",component,value" : ",particle,x,y,z";
    output_.buffer() += columns_ == 6 ? ",vx,vy,vz\n" : "\n";
  }

  sim::CostEstimate pace() const override { return sim::CostEstimate::kSteps; }

  void add(const sim::Moment& moment) override {
    for (std::size_t m = 0; m < moment.size(); ++m) {
      const sim::Model& model = task_.models[m];
      const sim::Frame& frame = moment[m];
      const std::size_t count = model.flat ? frame.components.size() : frame.x.size() / 3;
      for (std::size_t i = 0; i < count; ++i) {
        std::vector<double> row;
        if (model.flat) row.push_back(frame.components[i]);
        for (std::size_t c = 0; c < 3 && !model.flat; ++c) row.push_back(frame.x[3 * i + c]);
        for (std::size_t c = 0; c < 3 && !frame.v.empty(); ++c) row.push_back(frame.v[3 * i + c]);
        json_ ? json_row(model, frame, i, row) : csv_row(model, frame, i, row);
        output_.flush_if_full();
      }
    }
  }

  void commit() override { output_.commit(); }

 private:
  void csv_row(const sim::Model& model, const sim::Frame& frame, std::size_t i,
               const std::vector<double>& row) {
    std::string& out = output_.buffer();
    if (task_.world) out += sim::csv_field(model.name) + ",";
    out += std::to_string(frame.step) + ",";
    sim::append_number(out, frame.t);
    out += "," + std::to_string(i);
    for (const double value : row) {
      out += ',';
      sim::append_number(out, value);
    }
    out.append(columns_ - row.size(), ',');
    out += '\n';
  }

  void json_row(const sim::Model& model, const sim::Frame& frame, std::size_t i,
                const std::vector<double>& row) {
    static constexpr const char* kNames[] = {"x", "y", "z", "vx", "vy", "vz"};
    sim::JsonObject object;
    if (task_.world) object.text("system", model.name);
    object.integer("step", frame.step).number("t", frame.t);
    object.integer(model.flat ? "component" : "particle", static_cast<std::int64_t>(i));
    for (std::size_t c = 0; c < row.size(); ++c)
      object.number(model.flat ? "value" : kNames[c], row[c]);
    output_.buffer() += object.str() + "\n";
  }

  sim::WriterTask task_;
  bool json_;
  std::size_t columns_ = 1;
  sim::Output output_;
};

}  // namespace

SIM_PLUGIN(Writer, "csv/jsonl") {
  registrar.add(
      sim::Plugin<sim::Writer>{{.name = "csv",
                                .summary = "table of states, as --dump; also JSON lines, .jsonl",
                                .formula = "step,t,particle,x,y,z,vx,vy,vz"},
                               [](const sim::Params&, const sim::WriterTask& task) {
                                 return std::make_unique<Table>(task);
                               }});
}
