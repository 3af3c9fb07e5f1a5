// The files of --out: read back here, and by programs of others where they are installed.
#include <array>
#include <catch2/catch.hpp>
#include <cstring>

#include "core/output/png.h"
#include "tests/cli/program.h"
#include "tests/support/skip.h"
#include "tests/support/temporary.h"

namespace {

namespace fs = std::filesystem;
using Catch::Contains;
using sim_test::ProgramOptions;
using sim_test::run_sim;
using sim_test::TemporaryFolder;

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::string> files_of(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

template <class Number>
Number number_at(const std::string& bytes, std::size_t at) {
  Number value{};
  REQUIRE(at + sizeof value <= bytes.size());
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

// The rows of one step in a table that the program wrote.
std::vector<std::array<double, 3>> dumped(const fs::path& file, const std::string& step) {
  std::vector<std::array<double, 3>> rows;
  std::istringstream in(bytes_of(file));
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with(step + ",")) continue;
    std::istringstream cells(line);
    std::string cell;
    for (int skip = 0; skip < 3; ++skip) std::getline(cells, cell, ',');
    std::array<double, 3> x{};
    for (double& value : x) {
      std::getline(cells, cell, ',');
      value = std::stod(cell);
    }
    rows.push_back(x);
  }
  return rows;
}

}  // namespace

TEST_CASE("a run leaves its files, whole and by their names") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  const auto done = run_sim(
      {"-q",         "-T",    "0.1",   "--size",  "160x90",  "--out",          "a.png", "--out",
       "n-%03d.png", "--out", "a.csv", "--out",   "a.jsonl", "--out",          "a.xyz", "--out",
       "a.npz",      "--out", "a.ply", "--out",   "a.obj",   "--out",          "b.pc2", "--out",
       "a.vtp",      "--out", "s.pvd", "--every", "5",       "--dump=dump.csv"},
      here);
  INFO(done.err);
  REQUIRE(done.code == 0);
  CHECK(done.out.empty());
  CHECK(files_of(folder.path()) ==
        std::vector<std::string>{"a.csv", "a.jsonl", "a.npz", "a.obj", "a.ply", "a.png", "a.vtp",
                                 "a.xyz", "b.obj", "b.pc2", "dump.csv", "n-000.png", "n-001.png",
                                 "n-002.png", "n-003.png", "n-004.png", "s", "s.pvd"});
  CHECK(files_of(folder.path() / "s").size() == 5);
  CHECK(bytes_of(folder.path() / "a.csv") == bytes_of(folder.path() / "dump.csv"));
  CHECK(bytes_of(folder.path() / "a.png") == bytes_of(folder.path() / "n-004.png"));
  CHECK(bytes_of(folder.path() / "a.png") != bytes_of(folder.path() / "n-000.png"));

  const auto last = dumped(folder.path() / "dump.csv", "20");
  REQUIRE(last.size() == 64);
  const std::string ply = bytes_of(folder.path() / "a.ply");
  const std::size_t points = ply.find("end_header\n") + 11;
  for (const std::size_t i : {0U, 9U, 63U})
    for (std::size_t c = 0; c < 3; ++c)
      CHECK(number_at<double>(ply, points + 8 * (3 * i + c)) == last[i][c]);
  const std::string pc2 = bytes_of(folder.path() / "b.pc2");
  CHECK(number_at<std::int32_t>(pc2, 16) == 64);
  CHECK(number_at<std::int32_t>(pc2, 28) == 5);
  CHECK(pc2.size() == 32 + 5 * 64 * 12);
  CHECK(number_at<float>(pc2, 32 + (4 * 64 + 63) * 12 + 4) == static_cast<float>(last[63][1]));
  const std::string vtp = bytes_of(folder.path() / "a.vtp");
  CHECK_THAT(vtp, Contains("NumberOfPoints=\"64\""));
  CHECK_THAT(vtp, Contains("NumberOfLines=\"306\" NumberOfPolys=\"98\""));
  const std::size_t data = vtp.find("\n_") + 2 + 16;  // behind the time
  CHECK(number_at<std::uint64_t>(vtp, data) == 64 * 24);
  CHECK(number_at<double>(vtp, data + 8 + 63 * 24 + 8) == last[63][1]);
  CHECK_THAT(bytes_of(folder.path() / "a.xyz"), Contains("Time=0.1 Step=20"));
}

TEST_CASE("numpy reads what it is given") {
  sim_test::need_python("numpy", "python3-numpy");
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  REQUIRE(run_sim({"-q", "-T", "0.1", "--out", "a.npz", "--dump=d.csv"}, here).code == 0);
  REQUIRE(run_sim({"scenes/sample.lua", "-q", "-T", "0.1", "--out", "w.npz"}, here).code == 0);
  here.program = sim_test::kPython;
  const auto read = run_sim(
      {"-c",
       "import numpy as np\n"
       "a = np.load('a.npz'); d = np.genfromtxt('d.csv', delimiter=',', skip_header=1)\n"
       "assert a['x'].shape == (21, 64, 3) and a['v'].shape == (21, 64, 3)\n"
       "assert (a['x'].reshape(-1, 3) == d[:, 3:6]).all()\n"
       "assert (a['v'].reshape(-1, 3) == d[:, 6:9]).all()\n"
       "assert a['t'][20] == 0.1 and a['step'][20] == 20\n"
       "assert np.isfinite(a['kinetic'] + a['drift']).all()\n"
       "w = np.load('w.npz'); assert w['circle.x'].shape[1:] == (1, 3) and 'cloth.v' in w\n"},
      here);
  INFO(read.err);
  CHECK(read.code == 0);
}

TEST_CASE("films have their frames") {
  sim_test::need_program("ffprobe", "ffmpeg");
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  const auto made = run_sim(
      {"-q", "-T", "0.5", "--size", "160x90", "--out", "a.mp4", "--out", "a.gif", "--fps", "20"},
      here);
  INFO(made.err);
  REQUIRE(made.code == 0);
  CHECK(files_of(folder.path()) == std::vector<std::string>{"a.gif", "a.mp4"});
  here.program = "/usr/bin/ffprobe";
  for (const char* file : {"a.mp4", "a.gif"}) {
    const auto read = run_sim({"-v", "error", "-count_frames", "-show_entries",
                               "stream=width,height,nb_read_frames", "-of", "csv", file},
                              here);
    CHECK_THAT(read.out, Contains("stream,160,90,11"));
  }
}

TEST_CASE("without ffmpeg a film is refused before the run") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  here.environment = {{"PATH", "/nowhere"}};
  const auto refused = run_sim({"--out", "a.mp4"}, here);
  CHECK(refused.code == 5);
  CHECK_THAT(refused.err, Contains("apt-get install ffmpeg"));
  CHECK(refused.out.empty());
  CHECK(files_of(folder.path()).empty());
}

TEST_CASE("wrong files and looks are refused before the run") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  const auto says = [&](std::vector<std::string> arguments, int code, const std::string& words) {
    const auto done = run_sim(arguments, here);
    CHECK(done.code == code);
    CHECK_THAT(done.err, Contains(words));
    CHECK_THAT(done.err, Contains("sim: error: "));
    CHECK(files_of(folder.path()).empty());
  };
  says({"--out", "a.foo"}, 2, ".png");
  says({"--out", "a"}, 2, "its name has none");
  says({"--out", "a.png", "--out", "./a.png"}, 2, "two outputs for one file");
  says({"--out", "a-%s.png"}, 2, "%04d");
  says({"--out", "no/such/a.png"}, 5, "cannot write");
  says({"--out", "a.png", "--color", "heat"}, 2, "strain");
  says({"--out", "a.png", "--size", "9x9"}, 2, "1280x720");
  says({"--out", "a.png", "--fps", "5", "--every", "5"}, 2, "only one");
  says({"--wireframe"}, 2, "--out");
  says({"--surface"}, 2, "--out");
  says({"--out", "a.png", "-n", "1", "--surface"}, 2, "no water");
  says({"--out", "a.png", "-n", "1", "--springs", "64"}, 2, "0 to 63");
  says({"--out", "a.png", "-n", "1", "--trail", "64"}, 2, "0 to 63");
  says({"--out", "a.png", "-n", "1", "--trail", "body:0"}, 2, "no body of that number");
  says({"--out", "a.png", "--trail", "ball"}, 2, "no particle and no body");
  says({"--trail", "3"}, 2, "--out");
  says({"scenes/sample.lua", "--out", "a.vtp"}, 2, ".pvd");
}

TEST_CASE("a run that is interrupted leaves whole files") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  here.signal = SIGINT;
  here.signal_at = "0.1";
  const auto done =
      run_sim({"scenes/cloth.lua", "-s", "n=24", "-d", "1e-4", "-T", "1000", "--every", "500",
               "--size", "160x90", "--out", "a.png", "--out", "a.ply"},
              here);
  INFO(done.err);
  CHECK(done.code == 130);
  CHECK(files_of(folder.path()) == std::vector<std::string>{"a.ply", "a.png"});
  CHECK_THAT(bytes_of(folder.path() / "a.png"), Contains("IEND"));
}

TEST_CASE("a state that left the numbers leaves a picture of what was before") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  const auto done =
      run_sim({"-i", "euler", "-d", "0.02", "-T", "20", "--out", "a.png", "-q"}, here);
  CHECK(done.code == 4);
  CHECK(files_of(folder.path()) == std::vector<std::string>{"a.png"});
}

// The pictures of ./dev pictures, small.
TEST_CASE("the pictures of the README can be made again") {
  const TemporaryFolder folder;
  ProgramOptions script;
  script.program = std::string(SIM_SOURCE_DIR) + "/tests/pictures/make.sh";
  const auto made = run_sim({SIM_BINARY, folder.path().string(), "8"}, script);
  INFO(made.err);
  REQUIRE(made.code == 0);
  std::vector<std::string> kept = files_of(fs::path(SIM_SOURCE_DIR) / "tests/pictures");
  std::erase_if(kept, [](const std::string& name) {
    return !name.ends_with(".png") || name == "page.png";  // made by a browser
  });
  CHECK(files_of(folder.path()) == kept);
  CHECK(kept.size() >= 12);
}

TEST_CASE("a page holds its run and needs nothing else") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  REQUIRE(run_sim({"-q", "-s", "n=32", "-d", "0.002", "-T", "1", "--fps", "60", "--out", "a.html"},
                  here)
              .code == 0);
  const std::string page = bytes_of(folder.path() / "a.html");
  CHECK(page.starts_with("<!doctype html>"));
  CHECK(page.find("<meta http-equiv=\"Content-Security-Policy\"") < 200);
  CHECK_THAT(page, Contains("\"particles\":1024"));
  CHECK_THAT(page, Contains("\"springs\":5826"));
  CHECK(page.find("://") == std::string::npos);
  CHECK(page.size() < 400'000);
  const std::size_t data = page.find("text=\"") + 6;
  const std::size_t size = page.find('"', data) - data;
  CHECK(page.size() - size < 40'000);  // of which some are times and energies
}

TEST_CASE("a run is shown in a terminal only") {
  const auto piped = run_sim({"--show", "-T", "0.01"});
  CHECK(piped.code == 0);
  CHECK_THAT(piped.err, Contains("--show draws nothing: standard output is no terminal"));
  CHECK(piped.out.find('\x1b') == std::string::npos);
}

TEST_CASE("energies as a plot") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  REQUIRE(run_sim({"-q", "-T", "0.5", "--energy=e.svg"}, here).code == 0);
  const std::string svg = bytes_of(folder.path() / "e.svg");
  CHECK(svg.starts_with("<svg "));
  CHECK(svg.ends_with("</svg>\n"));
  for (const char* name : {"kinetic", "potential", "total", "t [s]"})
    CHECK_THAT(svg, Contains(name));
  CHECK(svg.find("nan") == std::string::npos);
  CHECK(run_sim({"--dump=d.svg"}, here).code == 2);
}

TEST_CASE("a run coloured by its error shows what its verdict says") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  const auto done = run_sim({"scenes/pendulum1.lua", "-i", "symplectic_euler", "-T", "1", "--out",
                             "e.html", "--color", "error"},
                            here);
  INFO(done.err);
  REQUIRE(done.code == 0);
  const std::string page = bytes_of(folder.path() / "e.html");
  CHECK_THAT(page, Contains("\"colour\":\"error\",\"values\":{\"name\":\"error\",\"unit\":\"m\""));
  // The end of the scale is the largest error, rounded up to 1, 2, 3, 5: the verdict's own figure.
  const std::size_t at = page.find("\"most\":") + 7;
  const double most = std::stod(page.substr(at));
  const std::size_t said = done.out.find("positions to ") + 13;
  REQUIRE(said != std::string::npos + 13);
  const double error = std::stod(done.out.substr(said));
  CHECK(most >= 0.8 * error);
  CHECK(most <= 2.2 * error);
  CHECK(run_sim({"scenes/pendulum1.lua", "-T", "0.1", "--out", "m.png", "--color", "mode", "--size",
                 "160x90"},
                here)
            .code == 0);
}

TEST_CASE("a scene says how it is looked at, and its user has the last word") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  const auto scene = [&](const std::string& look) {
    std::ofstream(folder.path() / "s.lua")
        << "local sim = require 'sim'\n"
           "local p = sim.particles { mass = 1 }\n"
           "local a, b = p:add { 0, 0, 0 }, p:add { 1, 0, 0 }\n"
           "p:pin(a)\n"
           "local s = sim.force.spring { stiffness = 100, rest = 1 }\n"
           "s:tie(a, b)\n"
           "return sim.scene { particles = p, forces = { s }, integrator = 'rk4', dt = 0.01,\n"
           "  duration = 0.05, look = "
        << look << " }\n";
  };
  scene("{ size = '200x100', color = 'strain:0.5', eye = {0, 0, 4}, at = {0.5, 0, 0} }");
  auto done = run_sim({"s.lua", "-q", "--out", "a.png"}, here);
  INFO(done.err);
  REQUIRE(done.code == 0);
  REQUIRE(run_sim({"s.lua", "-q", "--out", "b.png", "--size", "100x100"}, here).code == 0);
  const auto width = [&](const char* file) {
    const std::string bytes = bytes_of(folder.path() / file);
    return static_cast<unsigned char>(bytes[19]) + 256 * static_cast<unsigned char>(bytes[18]);
  };
  CHECK(width("a.png") == 200);
  CHECK(width("b.png") == 100);
  for (const auto& [look, why] : std::vector<std::pair<std::string, std::string>>{
           {"{ colour = 'strain' }", "color"},
           {"{ color = 'beauty' }", "nothing is coloured by that"},
           {"{ fov = 1000 }", "1 to 150 degrees"},
           {"{ wireframe = 1 }", "expected true or false"},
           {"{ surface = 1 }", "bad surface of look"},
           {"3", "bad look"}}) {
    scene(look);
    done = run_sim({"s.lua", "-q"}, here);
    CHECK(done.code == 3);
    CHECK_THAT(done.err, Contains("s.lua") && Contains(why));
  }
}

TEST_CASE("other programs read meshes") {
  sim_test::need_program("assimp", "assimp-utils");
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  REQUIRE(run_sim({"-q", "-T", "0.1", "--out", "a.ply", "--out", "a.obj"}, here).code == 0);
  here.program = "/usr/bin/assimp";
  for (const char* file : {"a.ply", "a.obj"}) {
    const auto read = run_sim({"info", file}, here);
    INFO(read.out << read.err);
    CHECK(read.code == 0);
    CHECK_THAT(read.out, Contains("Faces:              98") || Contains("Faces: 98"));
  }
}

TEST_CASE("VTK reads what it is given") {
  sim_test::need_python("vtkmodules.vtkIOXML", "python3-vtk9");
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  REQUIRE(run_sim({"-q", "-T", "0.1", "--out", "a.vtp", "--dump=d.csv"}, here).code == 0);
  here.program = sim_test::kPython;
  const auto read =
      run_sim({"-c",
               "from vtkmodules.vtkIOXML import vtkXMLPolyDataReader\n"
               "r = vtkXMLPolyDataReader(); r.SetFileName('a.vtp'); r.Update(); d = r.GetOutput()\n"
               "assert (d.GetNumberOfPoints(), d.GetNumberOfLines(), d.GetNumberOfPolys()) == (64, "
               "306, 98)\n"
               "rows = [[float(w) for w in l.split(',')[3:]] for l in open('d.csv') "
               "if l.startswith('20,')]\n"
               "v = d.GetPointData().GetArray('velocity')\n"
               "for i, row in enumerate(rows):\n"
               "    assert list(d.GetPoint(i)) + list(v.GetTuple(i)) == row\n"
               "f = d.GetCellData().GetArray('family')\n"
               "counts = [0, 0, 0, 0]\n"
               "for i in range(404): counts[int(f.GetValue(i))] += 1\n"
               "assert counts == [112, 98, 96, 98], counts\n"
               "assert d.GetCellData().GetArray('strain').GetNumberOfTuples() == 404\n"},
              here);
  INFO(read.err);
  CHECK(read.code == 0);
}
