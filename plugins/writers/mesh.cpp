// Meshes: PLY and Wavefront OBJ of the last moment, and point caches (PC2) of all with an OBJ of
// the first beside them, as Blender's mesh cache modifier takes them.
#include <filesystem>
#include <iostream>
#include <optional>

#include "core/base/text.h"
#include "core/output/bytes.h"
#include "core/output/output.h"
#include "core/output/scratch_file.h"
#include "core/output/writer.h"
#include "core/plugin/plugin.h"

namespace {

// All systems as one mesh, without what is torn.
struct Mesh {
  std::vector<double> x;
  std::vector<std::array<int, 3>> triangles;
  std::vector<std::array<int, 2>> edges;  // springs of systems without triangles

  Mesh(const std::vector<sim::Model>& models, const sim::Moment& moment) {
    for (std::size_t m = 0; m < models.size(); ++m) {
      const int first = static_cast<int>(x.size() / 3);
      x.insert(x.end(), moment[m].x.begin(), moment[m].x.end());
      for (const auto& t : models[m].triangles)
        if (!sim::torn(moment[m], t))
          triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
      if (!models[m].triangles.empty()) continue;
      for (const sim::ModelFamily& family : models[m].families)
        for (const auto& [a, b] : family.ends)
          if (!sim::torn(moment[m], a, b)) edges.push_back({a + first, b + first});
    }
  }
};

std::string ply(const Mesh& mesh) {
  std::string out = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                    std::to_string(mesh.x.size() / 3) +
                    "\nproperty double x\nproperty double y\nproperty double z\n";
  if (!mesh.triangles.empty())
    out += "element face " + std::to_string(mesh.triangles.size()) +
           "\nproperty list uchar int vertex_indices\n";
  if (!mesh.edges.empty())
    out += "element edge " + std::to_string(mesh.edges.size()) +
           "\nproperty int vertex1\nproperty int vertex2\n";
  out += "end_header\n";
  sim::append_bytes(out, std::span<const double>(mesh.x));
  for (const auto& t : mesh.triangles) {
    out += '\3';
    sim::append_bytes(out, std::span<const int>(t));
  }
  for (const auto& e : mesh.edges) sim::append_bytes(out, std::span<const int>(e));
  return out;
}

std::string obj(const Mesh& mesh) {
  std::string out;
  for (std::size_t i = 0; i < mesh.x.size(); i += 3) {
    out += 'v';
    for (std::size_t c = 0; c < 3; ++c) {
      out += ' ';
      sim::append_number(out, mesh.x[i + c]);
    }
    out += '\n';
  }
  for (const auto& t : mesh.triangles)
    out += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " +
           std::to_string(t[2] + 1) + "\n";
  for (const auto& e : mesh.edges)
    out += "l " + std::to_string(e[0] + 1) + " " + std::to_string(e[1] + 1) + "\n";
  return out;
}

class MeshFile final : public sim::Writer {
 public:
  explicit MeshFile(const sim::WriterTask& task)
      : task_(task), cache_(task.format == "pc2"), output_({task.file}, std::cout) {
    if (!cache_) return;
    first_.emplace(sim::Target{std::filesystem::path(task.file).replace_extension(".obj").string()},
                   std::cout);
    points_.emplace(task.file);
  }

  sim::CostEstimate pace() const override {
    return cache_ ? sim::CostEstimate::kFilm : sim::CostEstimate::kLast;
  }

  void add(const sim::Moment& moment) override {
    if (!cache_) {
      last_ = moment;
      return;
    }
    if (samples_++ == 0) last_ = moment;
    for (std::size_t m = 0; m < moment.size(); ++m) last_[m].torn = moment[m].torn;
    std::string points;
    for (const sim::Frame& frame : moment)
      for (const double x : frame.x) sim::append_bytes(points, static_cast<float>(x));
    if (samples_ == 1) count_ = points.size() / 12;
    points_->append(points);
  }

  void commit() override {
    std::string& out = output_.buffer();
    if (cache_) {
      out += std::string("POINTCACHE2\0", 12);
      sim::append_bytes(out, std::int32_t{1});
      sim::append_bytes(out, static_cast<std::int32_t>(count_));
      sim::append_bytes(out, 0.0F);  // first frame, and frames a sample
      sim::append_bytes(out, 1.0F);
      sim::append_bytes(out, static_cast<std::int32_t>(samples_));
      sim::append_scratch(output_, *points_, 0, points_->size());
      if (!last_.empty()) first_->buffer() = obj(Mesh(task_.models, last_));
      first_->commit();
    } else if (!last_.empty()) {
      const Mesh mesh(task_.models, last_);
      out += task_.format == "obj" ? obj(mesh) : ply(mesh);
    }
    output_.commit();
  }

 private:
  sim::WriterTask task_;
  bool cache_;
  sim::Output output_;
  std::optional<sim::Output> first_;
  sim::Moment last_;  // of a cache: the first, with what is torn at the end
  std::size_t samples_ = 0, count_ = 0;
  std::optional<sim::ScratchFile> points_;
};

}  // namespace

SIM_PLUGIN(Writer, "ply/obj/pc2") {
  registrar.add(sim::Plugin<sim::Writer>{
      {.name = "ply",
       .summary = "mesh of the last moment for MeshLab; also .obj, and .pc2 with all for Blender",
       .formula = "--out last.ply, --out last.obj, --out run.pc2 with run.obj beside it"},
      [](const sim::Params&, const sim::WriterTask& task) {
        return std::make_unique<MeshFile>(task);
      }});
}
