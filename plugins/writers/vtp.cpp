// VTK's files of polygons: one moment, or with .pvd a series in a folder beside, as ParaView reads.
#include <filesystem>
#include <iostream>
#include <optional>

#include "core/base/text.h"
#include "core/output/bytes.h"
#include "core/output/output.h"
#include "core/output/staging_folder.h"
#include "core/output/writer.h"
#include "core/plugin/plugin.h"

namespace {

namespace fs = std::filesystem;

// An XML file whose arrays lie behind it as raw bytes, each after its length.
class Vtp {
  static constexpr std::size_t kBlock = 4096;

 public:
  Vtp(const sim::Model& model, const sim::Frame& frame) {
    const std::size_t n = frame.x.size() / 3;
    std::vector<std::int64_t> lines, polys, verts, family;
    std::vector<double> strain;
    for (std::size_t f = 0; f < model.families.size(); ++f)
      for (std::size_t s = 0; s < model.families[f].ends.size(); ++s) {
        const auto& [a, b] = model.families[f].ends[s];
        if (sim::torn(frame, a, b)) continue;
        for (const int i : {a, b}) lines.push_back(i);
        strain.push_back(sim::strain(model, frame, static_cast<int>(f), s));
        family.push_back(static_cast<std::int64_t>(f));
      }
    for (const auto& triangle : model.triangles) {
      if (sim::torn(frame, triangle)) continue;
      for (const int i : triangle) polys.push_back(i);
    }
    if (lines.empty() && polys.empty())
      for (std::size_t i = 0; i < n; ++i) verts.push_back(static_cast<std::int64_t>(i));
    // Cells go verts, lines, polygons; triangles have no strain and no family.
    strain.resize(verts.size() + lines.size() / 2 + polys.size() / 3, std::nan(""));
    family.resize(strain.size(), -1);

    const auto count = [](std::size_t value) { return std::to_string(value); };
    head_ =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
        "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n"
        "<FieldData>";
    array("TimeValue", "Float64", 1, std::vector<double>{frame.t}, 1);
    head_ += "</FieldData>\n<Piece NumberOfPoints=\"" + count(n) + "\" NumberOfVerts=\"" +
             count(verts.size()) + "\" NumberOfLines=\"" + count(lines.size() / 2) +
             "\" NumberOfPolys=\"" + count(polys.size() / 3) + "\">\n<Points>";
    array("Points", "Float64", 3, frame.x);
    head_ += "</Points>\n<PointData>";
    if (!frame.v.empty()) array("velocity", "Float64", 3, frame.v);
    std::vector<std::int64_t> id(n), pinned(n);
    for (std::size_t i = 0; i < n; ++i) id[i] = static_cast<std::int64_t>(i);
    for (const int i : model.pinned) pinned[static_cast<std::size_t>(i)] = 1;
    array("id", "Int64", 1, id);
    array("pinned", "Int64", 1, pinned);
    head_ += "</PointData>\n";
    cells("Verts", verts, 1);
    cells("Lines", lines, 2);
    cells("Polys", polys, 3);
    head_ += "<CellData>";
    array("strain", "Float64", 1, strain);
    array("family", "Int64", 1, family);
    head_ += "</CellData>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_";
  }

  void write(sim::Output& output) const {
    output.buffer() += head_;
    for (std::size_t at = 0; at < data_.size(); at += kBlock, output.flush_if_full())
      output.buffer().append(data_, at, kBlock);
    output.buffer() += "\n</AppendedData>\n</VTKFile>\n";
    output.commit();
  }

 private:
  template <class Number>
  void array(const char* name, const char* type, int components, const std::vector<Number>& values,
             int tuples = 0) {
    head_ += std::string("<DataArray type=\"") + type + "\" Name=\"" + name +
             "\" NumberOfComponents=\"" + std::to_string(components) + "\"" +
             (tuples ? " NumberOfTuples=\"1\"" : "") + " format=\"appended\" offset=\"" +
             std::to_string(data_.size()) + "\"/>";
    sim::append_bytes(data_, static_cast<std::uint64_t>(values.size() * sizeof(Number)));
    sim::append_bytes(data_, std::span<const Number>(values));
  }

  void cells(const char* name, const std::vector<std::int64_t>& ids, std::size_t corners) {
    std::vector<std::int64_t> ends;
    for (std::size_t i = corners; i <= ids.size(); i += corners)
      ends.push_back(static_cast<std::int64_t>(i));
    head_ += std::string("<") + name + ">";
    array("connectivity", "Int64", 1, ids);
    array("offsets", "Int64", 1, ends);
    head_ += std::string("</") + name + ">\n";
  }

  std::string head_, data_;
};

class ParaView final : public sim::Writer {
 public:
  explicit ParaView(const sim::WriterTask& task) : task_(task), series_(task.format == "pvd") {
    if (!series_ && task.models.size() > 1)
      throw sim::Error(sim::ErrorKind::kUsage,
                       {"several systems for one .vtp", task.file, "a file holds one of them",
                        "write a series: --out run.pvd"});
    output_.emplace(sim::Target{task.file}, std::cout);
    if (!series_) return;
    files_.emplace(fs::path(task.file).replace_extension());
    output_->buffer() +=
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" "
        "byte_order=\"LittleEndian\">\n<Collection>\n";
  }

  sim::CostEstimate pace() const override {
    return series_ ? sim::CostEstimate::kFilm : sim::CostEstimate::kLast;
  }

  void add(const sim::Moment& moment) override {
    if (!series_) {
      last_ = moment;
      return;
    }
    for (std::size_t m = 0; m < moment.size(); ++m) {
      const std::string name = name_of(m, count_);
      sim::Output file(files_->temporary() / name, files_->folder() / name);
      Vtp(task_.models[m], moment[m]).write(file);
      output_->buffer() += "<DataSet timestep=\"" + sim::shortest(moment.front().t) + "\" part=\"" +
                           std::to_string(m) + "\" file=\"" + folder() + "/" + name + "\"/>\n";
    }
    ++count_;
  }

  void commit() override {
    if (!series_) {
      if (!last_.empty()) Vtp(task_.models[0], last_[0]).write(*output_);
      return;
    }
    output_->buffer() += "</Collection>\n</VTKFile>\n";
    files_->commit();
    output_->commit();
    for (std::size_t m = 0; m < task_.models.size(); ++m)
      sim::remove_later_files(count_,
                              [&](std::size_t i) { return files_->folder() / name_of(m, i); });
  }

 private:
  std::string folder() const { return files_->folder().filename().string(); }

  std::string name_of(std::size_t system, std::size_t moment) const {
    std::string number = std::to_string(moment);
    if (number.size() < 5) number.insert(0, 5 - number.size(), '0');
    return (task_.world ? task_.models[system].name : folder()) + "_" + number + ".vtp";
  }

  sim::WriterTask task_;
  bool series_;
  std::optional<sim::StagingFolder> files_;
  std::size_t count_ = 0;
  std::optional<sim::Output> output_;
  sim::Moment last_;
};

}  // namespace

SIM_PLUGIN(Writer, "vtp/pvd") {
  registrar.add(sim::Plugin<sim::Writer>{
      {.name = "vtp",
       .summary =
           "ParaView: springs with strain and family, surfaces, velocities; .pvd: all moments",
       .formula = "--out last.vtp, --out run.pvd with the files of its moments in run/",
       .source = "VTK's XML file formats"},
      [](const sim::Params&, const sim::WriterTask& task) {
        return std::make_unique<ParaView>(task);
      }});
}
