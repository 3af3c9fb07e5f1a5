// Files for other programs, read back by plain readers and compared with numbers of plain loops.
#include <catch2/catch.hpp>

#include <numeric>

#include "tests/output/readers.h"
#include "tests/output/written.h"

namespace sim_test {
namespace {

std::vector<std::string> run_of(const std::string& scene, const std::vector<std::string>& files) {
  std::vector<std::string> words{scene, "-q", "--no-verify", "--every", "1"};
  for (const std::string& file : files) words.insert(words.end(), {"--out", file});
  return words;
}

void check_points(const std::vector<std::array<double, 3>>& points, const StripFrame& frame) {
  REQUIRE(points.size() == kStripParticles);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) CHECK(points[i][c] == near(frame.x[i][c]));
}

void check_vtp(const std::string& bytes, std::size_t moment) {
  const StripFrame frame = strip_frames()[moment];
  const VtpFile file = read_vtp(bytes);
  CHECK(file.counts == std::map<std::string, long>{{"NumberOfPoints", 6},
                                                   {"NumberOfVerts", 0},
                                                   {"NumberOfLines", 7},
                                                   {"NumberOfPolys", 3}});
  const auto numbers = [&](const std::string& name, int components, std::size_t size) {
    INFO(name);
    REQUIRE(file.arrays.contains(name));
    CHECK(file.arrays.at(name).components == components);
    REQUIRE(file.arrays.at(name).numbers.size() == size);
    return file.arrays.at(name).numbers;
  };
  CHECK(numbers("FieldData/TimeValue", 1, 1)[0] == near(frame.t));
  const auto x = numbers("Points/Points", 3, 18), v = numbers("PointData/velocity", 3, 18);
  const auto ids = numbers("PointData/id", 1, 6), pinned = numbers("PointData/pinned", 1, 6);
  for (std::size_t i = 0; i < kStripParticles; ++i) {
    CHECK(ids[i] == static_cast<double>(i));
    CHECK(pinned[i] == (i == 0 ? 1 : 0));
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK(x[3 * i + c] == near(frame.x[i][c]));
      CHECK(v[3 * i + c] == near(frame.v[i][c]));
    }
  }
  CHECK(numbers("Verts/connectivity", 1, 0).empty());
  const auto lines = numbers("Lines/connectivity", 1, 14), ends = numbers("Lines/offsets", 1, 7);
  const auto strain = numbers("CellData/strain", 1, 10), family = numbers("CellData/family", 1, 10);
  for (std::size_t s = 0; s < kStripSprings.size(); ++s) {
    const StripSpring& spring = kStripSprings[s];
    CHECK(lines[2 * s] == spring.a);
    CHECK(lines[2 * s + 1] == spring.b);
    CHECK(ends[s] == static_cast<double>(2 * s + 2));
    CHECK(strain[s] == near(spring.length(frame) / spring.rest - 1));
    CHECK(family[s] == spring.family);
  }
  const auto corners = numbers("Polys/connectivity", 1, 9),
             offsets = numbers("Polys/offsets", 1, 3);
  for (std::size_t t = 0; t < kStripTriangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) CHECK(corners[3 * t + k] == kStripTriangles[t][k]);
    CHECK(offsets[t] == static_cast<double>(3 * t + 3));
    CHECK(std::isnan(strain[7 + t]));
    CHECK(family[7 + t] == -1);
  }
}

}  // namespace

TEST_CASE("arrays for numpy have the numbers of the run", "[output]") {
  const WritingFolder folder;
  folder.run(run_of("strip.lua", {"a.npz"}));
  folder.run(run_of("world.lua", {"w.npz"}));
  const auto one = read_zip(folder.text("a.npz")), world = read_zip(folder.text("w.npz"));
  CHECK(one.size() == 8);
  CHECK(world.size() == 8 + 2 * 3);
  using Shape = std::vector<std::size_t>;
  const auto check = [&](const std::map<std::string, std::string>& files,
                         const std::string& prefix) {
    const auto array = [&](const std::string& name, const Shape& shape) {
      INFO(prefix << name);
      REQUIRE(files.contains(prefix + name + ".npy"));
      const NpyArray read = read_npy(files.at(prefix + name + ".npy"));
      CHECK(read.type == (name == "step" ? "<i8" : "<f8"));
      REQUIRE(read.shape == shape);
      return read;
    };
    const auto frames = strip_frames();
    const NpyArray step = array("step", {5}), t = array("t", {5}), x = array("x", {5, 6, 3}),
                   v = array("v", {5, 6, 3}), kinetic = array("kinetic", {5}),
                   potential = array("potential", {5}), work = array("work", {5}),
                   drift = array("drift", {5});
    double taken = 0;
    for (std::size_t f = 0; f < kStripFrames; ++f) {
      if (f > 0) taken += kStripStep * (frames[f - 1].drag_power + frames[f].drag_power) / 2;
      CHECK(step.at(f) == static_cast<double>(f));
      CHECK(t.at(f) == near(frames[f].t));
      CHECK(kinetic.at(f) == near(frames[f].kinetic));
      CHECK(potential.at(f) == near(frames[f].potential));
      CHECK(work.at(f) == Approx(taken).epsilon(1e-2));
      CHECK(drift.at(f) ==
            Approx(frames[f].total() + work.at(f) - frames[0].total()).margin(1e-12));
      for (std::size_t i = 0; i < kStripParticles; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
          CHECK(x.at((f * 6 + i) * 3 + c) == near(frames[f].x[i][c]));
          CHECK(v.at((f * 6 + i) * 3 + c) == near(frames[f].v[i][c]));
        }
    }
  };
  check(one, "");
  check(world, "strip.");
  const NpyArray flow = read_npy(world.at("flow.x.npy")), flat = read_npy(world.at("flat.x.npy"));
  REQUIRE(flow.shape == Shape{5, 2, 3});
  REQUIRE(flat.shape == Shape{5, 4});
  for (std::size_t f = 0; f < kStripFrames; ++f) {
    for (std::size_t k = 0; k < 6; ++k)
      CHECK(flow.at(6 * f + k) == near(flow_frames()[f][k / 3][k % 3]));
    for (std::size_t k = 0; k < 4; ++k) CHECK(flat.at(4 * f + k) == near(flat_frames()[f][k]));
    for (const char* system : {"flow.", "flat."}) {
      CHECK(read_npy(world.at(std::string(system) + "t.npy")).at(f) ==
            near(kStripStep * static_cast<double>(f)));
      CHECK(read_npy(world.at(std::string(system) + "step.npy")).at(f) == static_cast<double>(f));
    }
  }
}

TEST_CASE("files of VTK have points, cells, families and strains", "[output]") {
  const WritingFolder folder;
  folder.run(run_of("strip.lua", {"a.vtp", "s.pvd"}));
  check_vtp(folder.text("a.vtp"), kStripFrames - 1);
  const std::string series = folder.text("s.pvd");
  std::size_t moment = 0;
  for (std::size_t at = series.find("<DataSet "); at != std::string::npos;
       at = series.find("<DataSet ", at + 1), ++moment) {
    CHECK(number_behind(series, "timestep=\"", at) == near(0.01 * static_cast<double>(moment)));
    CHECK(number_behind(series, "part=\"", at) == 0);
    const std::size_t name = series.find("file=\"", at) + 6;
    check_vtp(folder.text(series.substr(name, series.find('"', name) - name)), moment);
  }
  CHECK(moment == kStripFrames);
}

TEST_CASE("a series of a world has a file for each system and moment", "[output]") {
  const WritingFolder folder;
  folder.run(run_of("world.lua", {"s.pvd"}));
  const std::string series = folder.text("s.pvd");
  for (std::size_t moment = 0; moment < kStripFrames; ++moment) {
    const std::string number = "_0000" + std::to_string(moment) + ".vtp";
    CHECK(series.find("part=\"2\" file=\"s/strip" + number) != std::string::npos);
    check_vtp(folder.text("s/strip" + number), moment);
    const VtpFile flow = read_vtp(folder.text("s/flow" + number));
    CHECK(flow.counts.at("NumberOfVerts") == 2);
    CHECK_FALSE(flow.arrays.contains("PointData/velocity"));
    for (std::size_t k = 0; k < 6; ++k)
      CHECK(flow.arrays.at("Points/Points").numbers.at(k) ==
            near(flow_frames()[moment][k / 3][k % 3]));
  }
}

TEST_CASE("meshes have the points and triangles of their moments", "[output]") {
  const WritingFolder folder;
  folder.run(run_of("strip.lua", {"a.ply", "a.obj", "b.pc2"}));
  const auto frames = strip_frames();
  const PlyFile ply = read_ply(folder.text("a.ply")), obj = read_obj(folder.text("a.obj")),
                first = read_obj(folder.text("b.obj"));
  check_points(ply.points, frames.back());
  check_points(obj.points, frames.back());
  check_points(first.points, frames.front());
  for (const PlyFile* mesh : {&ply, &obj, &first}) {
    CHECK(mesh->edges.empty());
    REQUIRE(mesh->faces.size() == kStripTriangles.size());
    for (std::size_t t = 0; t < kStripTriangles.size(); ++t)
      CHECK(std::ranges::equal(mesh->faces[t], kStripTriangles[t]));
  }
  const std::string cache = folder.text("b.pc2");
  REQUIRE(cache.size() == 32 + 4 * 3 * kStripParticles * kStripFrames);
  CHECK(cache.substr(0, 12) == std::string("POINTCACHE2\0", 12));
  CHECK(number_at<std::int32_t>(cache, 12) == 1);
  CHECK(number_at<std::int32_t>(cache, 16) == kStripParticles);
  CHECK(number_at<float>(cache, 20) == 0);
  CHECK(number_at<float>(cache, 24) == 1);
  CHECK(number_at<std::int32_t>(cache, 28) == kStripFrames);
  for (std::size_t k = 0; k < 3 * kStripParticles * kStripFrames; ++k)
    CHECK(number_at<float>(cache, 32 + 4 * k) ==
          Approx(frames[k / 18].x[k % 18 / 3][k % 3]).epsilon(1e-7).margin(1e-9));
}

TEST_CASE("meshes of springs without triangles have an edge for each", "[output]") {
  const WritingFolder folder;
  std::string ropes = kStrip;
  ropes.replace(ropes.find("surfaces = { skin }, "), 21, "");
  write_text(folder.at("ropes.lua"), ropes);
  folder.run(run_of("ropes.lua", {"a.ply", "a.obj"}));
  for (const PlyFile& mesh : {read_ply(folder.text("a.ply")), read_obj(folder.text("a.obj"))}) {
    check_points(mesh.points, strip_frames().back());
    CHECK(mesh.faces.empty());
    REQUIRE(mesh.edges.size() == kStripSprings.size());
    for (std::size_t s = 0; s < kStripSprings.size(); ++s)
      CHECK(mesh.edges[s] == std::array<int, 2>{kStripSprings[s].a, kStripSprings[s].b});
  }
}

TEST_CASE("meshes leave out what is torn", "[output]") {
  // A strip of two cells and a gap between them, whose halves fly apart.
  const WritingFolder folder;
  write_text(folder.at("torn.lua"),
             "local sim = require 'sim'\n"
             "local p = sim.particles { mass = 1 }\n"
             "for i = 0, 7 do\n"
             "  p:add({i % 4, i // 4, 0}, { velocity = {i % 4 < 2 and 0 or 3, 0, 0} })\n"
             "end\n"
             "local threads = sim.force.spring { stiffness = 1, break_strain = 0.2 }\n"
             "local faces = {}\n"
             "for i = 0, 2 do\n"
             "  threads:tie(i, i + 1); threads:tie(i + 4, i + 5); threads:tie(i, i + 5)\n"
             "  faces[#faces + 1] = {i, i + 1, i + 5}; faces[#faces + 1] = {i, i + 5, i + 4}\n"
             "end\n"
             "for i = 0, 3 do threads:tie(i, i + 4) end\n"
             "local sheet = sim.surface { particles = p, triangles = faces }\n"
             "return sim.scene { particles = p, surfaces = { sheet }, forces = { threads },\n"
             "  integrator = 'verlet', dt = 0.01, duration = 0.5 }\n");
  folder.run(run_of("torn.lua", {"a.ply", "a.obj", "a.vtp", "b.pc2"}));
  for (const PlyFile& mesh : {read_ply(folder.text("a.ply")), read_obj(folder.text("a.obj")),
                              read_obj(folder.text("b.obj"))}) {
    CHECK(mesh.faces.size() == 4);
    for (const auto& face : mesh.faces)
      CHECK(std::ranges::all_of(face, [&](int id) { return id % 4 / 2 == face[0] % 4 / 2; }));
  }
  const VtpFile vtp = read_vtp(folder.text("a.vtp"));
  CHECK(vtp.counts.at("NumberOfPolys") == 4);
  CHECK(vtp.counts.at("NumberOfLines") == 10);
}

TEST_CASE("extended XYZ has each number in its column", "[output]") {
  const WritingFolder folder;
  folder.run(run_of("world.lua", {"a.xyz"}));
  std::istringstream in(folder.text("a.xyz"));
  const auto frames = strip_frames();
  for (std::size_t f = 0; f < kStripFrames; ++f) {
    std::string line;
    std::getline(in, line);
    CHECK(line == "9");
    std::getline(in, line);
    CHECK(line.starts_with("Properties=species:S:1:pos:R:3:velo:R:3:mass:R:1:id:I:1:system:I:1 "));
    CHECK(number_behind(line, " Time=") == near(frames[f].t));
    CHECK(number_behind(line, " Step=") == static_cast<double>(f));
    // One row of the flat system, two of the flow, six of the strip.
    for (std::size_t i = 0; i < 9; ++i) {
      std::string species;
      double x[3], v[3], mass = 0, id = -1, system = -1;
      in >> species;
      for (double& each : x) in >> each;
      for (double& each : v) in >> each;
      in >> mass >> id >> system;
      REQUIRE(in);
      CHECK(species == "H");
      CHECK(system == (i == 0 ? 0 : i < 3 ? 1 : 2));
      const std::size_t own = i == 0 ? 0 : i < 3 ? i - 1 : i - 3;
      CHECK(id == static_cast<double>(own));
      CHECK(mass == near(i < 3 ? 1 : strip_mass(static_cast<int>(own))));
      for (std::size_t c = 0; c < 3; ++c) {
        CHECK(x[c] == near(i == 0  ? flat_frames()[f][c]
                           : i < 3 ? flow_frames()[f][own][c]
                                   : frames[f].x[own][c]));
        CHECK(v[c] == near(i < 3 ? 0 : frames[f].v[own][c]));
      }
    }
    std::getline(in, line);
  }
  CHECK(in.peek() == EOF);
}

}  // namespace sim_test
