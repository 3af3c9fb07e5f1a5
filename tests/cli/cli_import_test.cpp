// Meshes of other programs as scenes.
#include <catch2/catch.hpp>
#include <fstream>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

using Catch::Contains;

constexpr const char* kPyramid =
    "# a pyramid, its base a polygon\nv 0 1 0\nv -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 9 9 9\n"
    "vn 0 1 0\nf 1/1/1 3//1 2\nf 1 4 3\nf 1 5 4\nf 1 2 5\nf -5 -4 -3 -2\nf 1 1 2\n";

}  // namespace

TEST_CASE("a mesh becomes a scene with springs along its edges and across them") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  std::ofstream(folder.path() / "pyramid.obj") << kPyramid;
  const Outcome made = run_sim({"import", "pyramid.obj", "--out", "p.lua"}, here);
  INFO(made.err);
  REQUIRE(made.code == 0);
  CHECK_THAT(made.err, Contains("1 triangles without an area"));
  // 5 of the 6 points are used; 8 edges and a diagonal of the base, which 9 times have two sides.
  const Outcome run = run_sim({"p.lua"}, here);
  INFO(run.err);
  CHECK(run.code == 0);
  CHECK_THAT(run.out, Contains("5, 1 pinned") && Contains("18: 9 edge, 9 across"));
  CHECK_THAT(run.out, Contains("trusted: "));
  CHECK(run_sim({"import", "pyramid.obj"}, here).out == read_text(folder.path() / "p.lua"));
}

TEST_CASE("what sim writes as a mesh it reads again, point for point") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  REQUIRE(run_sim({"-q", "-s", "n=4", "-T", "0.1", "--out", "a.ply", "--out", "a.obj",
                   "--dump=d.csv", "--every", "1000"},
                  here)
              .code == 0);
  for (const char* file : {"a.ply", "a.obj"}) {
    REQUIRE(run_sim({"import", file, "--out", "b.lua"}, here).code == 0);
    REQUIRE(run_sim({"b.lua", "-n", "0", "-q", "--dump=e.csv"}, here).code == 0);
    const auto mine = lines_of(read_text(folder.path() / "d.csv"));
    const auto theirs = lines_of(read_text(folder.path() / "e.csv"));
    REQUIRE(theirs.size() == 17);
    for (std::size_t i = 1; i <= 16; ++i) {
      const std::string row = mine[mine.size() - 17 + i];
      const auto place = [](const std::string& line) {  // x,y,z
        std::size_t at = 0;
        for (int k = 0; k < 3; ++k) at = line.find(',', at) + 1;
        std::size_t end = at;
        for (int k = 0; k < 3; ++k) end = line.find(',', end) + 1;
        return line.substr(at, end - at);
      };
      CHECK(place(theirs[i]) == place(row));
    }
  }
}

TEST_CASE("what is no mesh is refused with its place") {
  const TemporaryFolder folder;
  ProgramOptions here;
  here.folder = folder.path();
  const auto refused = [&](const std::string& file, const std::string& text) {
    std::ofstream(folder.path() / file, std::ios::binary) << text;
    const Outcome outcome = run_sim({"import", file, "--out", "x.lua"}, here);
    CHECK(outcome.code == 2);
    CHECK_FALSE(std::filesystem::exists(folder.path() / "x.lua"));
    return outcome.err;
  };
  CHECK_THAT(refused("a.obj", "v 0 0\n"), Contains("a.obj:1: a point has three numbers"));
  CHECK_THAT(refused("a.obj", "v 0 0 nan\n"), Contains("a.obj:1: a point has three"));
  CHECK_THAT(refused("a.obj", "v 0 0 0\nf 1 2 3\n"), Contains("a.obj:2: a face has a point"));
  CHECK_THAT(refused("a.obj", "v 0 0 0\nf 1 -2 0\n"), Contains("a.obj:2: '0' is no point"));
  CHECK_THAT(refused("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
             Contains("a.obj: it has no triangle"));
  CHECK_THAT(refused("a.stl", "solid\n"), Contains("a.stl: its ending is neither"));
  CHECK_THAT(refused("a.ply", "plx\n"), Contains("a.ply:1: it does not begin with ply"));
  CHECK_THAT(refused("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"),
             Contains("a.ply:5: its header has no end"));
  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1000000\nproperty double x\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  CHECK_THAT(refused("a.ply", head + "12345678"),
             Contains("a.ply, byte " + std::to_string(head.size() + 8) + ": it ends too early"));
  CHECK_THAT(refused("a.ply", "ply\nformat binary_big_endian 1.0\n"),
             Contains("a.ply:2: format binary_big_endian is not"));
  CHECK_THAT(refused("a.ply", "ply\nformat ascii 1.0\nelement vertex 99999999999\n"),
             Contains("a.ply:3: it has a bad number"));
  CHECK(run_sim({"import", "nowhere.obj"}, here).code == 5);
  CHECK(run_sim({"import"}, here).code == 2);
  CHECK(run_sim({"import", "a.obj", "--out", "a.txt"}, here).code == 2);
}

}  // namespace sim_test
