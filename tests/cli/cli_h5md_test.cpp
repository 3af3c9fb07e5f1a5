// Files of H5MD: what h5py and MDAnalysis read in them, what comes back as a scene, and what does
// not.
#include <catch2/catch.hpp>
#include <filesystem>

#include "tests/cli/program.h"
#include "tests/support/bare_program.h"
#include "tests/support/skip.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

namespace fs = std::filesystem;
using Catch::Contains;
using Words = std::vector<std::string>;

struct Here {
  TemporaryFolder folder;
  ProgramOptions options;

  Here() { options.folder = folder.path(); }
  fs::path operator()(const std::string& name) const { return folder.path() / name; }
  Outcome sim(const Words& words) const { return run_sim(words, options); }
  Outcome python(const std::string& script) const {
    ProgramOptions with = options;
    with.program = kPython;
    return run_sim({"-c", script}, with);
  }
};

void need_hdf5(const std::string& other_packages = "") {
  if (!fs::exists(fs::path(SIM_PLUGIN_DIR) / "writers/h5md.so"))
    skip("a build with HDF5", "libhdf5-dev" + other_packages);
}

void need_h5py() {
  need_hdf5(" python3-h5py");
  need_python("h5py", "python3-h5py");
}

}  // namespace

TEST_CASE("without HDF5 its files are refused with the package that is missing") {
  Here here;
  const TemporaryFolder bare;
  here.options.program = bare_program(bare.path());
  for (const Words& words :
       std::vector<Words>{{"--out", "a.h5"},
                          {"export", "scenes/cloth.lua", "--format", "h5md", "a.h5"},
                          {"import", "a.h5"}}) {
    write_text(here("a.h5"), "x");
    const Outcome refused = here.sim(words);
    CHECK((refused.code == 2 || refused.code == 5));
    CHECK_THAT(refused.err, Contains("install libhdf5-dev and build again"));
    CHECK(read_text(here("a.h5")) == "x");
  }
}

TEST_CASE("a run in H5MD is what the tables say, and the same bytes each time") {
  need_h5py();
  const Here here;
  const Outcome made =
      here.sim({"-q", "-T", "0.1", "--out", "a.h5", "--dump=d.csv", "--energy=e.csv"});
  INFO(made.err);
  REQUIRE(made.code == 0);
  CHECK(files_in(here.folder.path()) == 4);
  const Outcome read = here.python(R"py(
import h5py, numpy as np
f = h5py.File('a.h5', 'r')
d = np.genfromtxt('d.csv', delimiter=',', skip_header=1)
e = np.genfromtxt('e.csv', delimiter=',', skip_header=1)
assert list(f['h5md'].attrs['version']) == [1, 1]
assert f['h5md/creator'].attrs['name'] == b'sim' and f['h5md/author'].attrs['name']
g = f['particles/all']
assert g['box'].attrs['dimension'] == 3 and list(g['box'].attrs['boundary']) == [b'none'] * 3
assert g['position/value'].shape == (21, 64, 3)
assert (g['position/value'][:].reshape(-1, 3) == d[:, 3:6]).all()
assert (g['velocity/value'][:].reshape(-1, 3) == d[:, 6:9]).all()
for name in ['position', 'velocity']:
    assert (g[name + '/step'][:] == e[:, 0]).all() and (g[name + '/time'][:] == e[:, 1]).all()
for column, name in enumerate(['kinetic_energy', 'potential_energy']):
    assert (f['observables'][name]['value'][:] == e[:, 2 + column]).all()
assert (f['observables']['work']['value'][:] == e[:, 5]).all()
assert (g['mass'][:] == 1 / 64).all() and (g['id'][:] == np.arange(64)).all()
assert list(np.nonzero(g['species'][:] == 1)[0]) == [0, 7] and g['species'][:].sum() == 2
s = f['connectivity/springs']
assert s.shape == (306, 2) and f[s.attrs['particles_group']] == g
p = f['parameters/sim/all']
assert p['spring_rest'].shape == (306,) and p.attrs['drag'] == 2 / 64 and p.attrs['dt'] == 0.005
assert list(p.attrs['gravity']) == [0, -9.81, 0] and p.attrs['integrator'] == b'rk4'
length = np.linalg.norm(np.diff(g['position/value'][0][s[:]], axis=1)[:, 0], axis=1)
assert np.abs(length - p['spring_rest'][:]).max() < 1e-15
)py");
  INFO(read.err);
  CHECK(read.code == 0);
  REQUIRE(here.sim({"-q", "-T", "0.1", "--out", "b.hdf5"}).code == 0);
  CHECK(read_text(here("a.h5")) == read_text(here("b.hdf5")));
}

TEST_CASE("the file beside an H5MD file says where its numbers lie") {
  need_h5py();
  const Here here;
  REQUIRE(here.sim({"-q", "-T", "0.02", "--out", "a.h5"}).code == 0);
  // Reads the XDMF as ParaView does: the part of the array that each grid names.
  const Outcome read = here.python(R"py(
import h5py, numpy as np, xml.etree.ElementTree as xml
f = h5py.File('a.h5', 'r')
grids = xml.parse('a.xmf').getroot().find('Domain/Grid').findall('Grid')
assert len(grids) == 5
for moment, grid in enumerate(grids):
    assert float(grid.find('Time').get('Value')) == f['particles/all/position/time'][moment]
    for name, where in [('position', 'Geometry'), ('velocity', 'Attribute')]:
        item = grid.find(where + '/DataItem')
        start, stride, count = np.array(item[0].text.split(), int).reshape(3, 3)
        file, path = item[1].text.split(':')
        data = h5py.File(file, 'r')[path]
        assert list(data.shape) == [int(n) for n in item[1].get('Dimensions').split()]
        piece = data[tuple(slice(a, a + n * s, s) for a, s, n in zip(start, stride, count))][0]
        assert (piece == f['particles/all'][name]['value'][moment]).all()
    ties = grid.find('Topology/DataItem').text.split(':')[1]
    assert f[ties].shape == (int(grid.find('Topology').get('NumberOfElements')), 2)
)py");
  INFO(read.err);
  CHECK(read.code == 0);
}

TEST_CASE("MDAnalysis reads runs and worlds") {
  need_hdf5(" python3-h5py python3-mdanalysis");
  need_h5py();
  need_python("MDAnalysis", "python3-mdanalysis");
  const Here here;
  REQUIRE(here.sim({"-q", "-T", "0.1", "--every", "4", "--out", "a.h5md", "--dump=d.csv"}).code ==
          0);
  REQUIRE(here.sim({"scenes/sample.lua", "-q", "-T", "0.1", "--out", "w.h5"}).code == 0);
  const Outcome read = here.python(R"py(
import MDAnalysis as mda, numpy as np, h5py
d = np.genfromtxt('d.csv', delimiter=',', skip_header=1).reshape(6, 64, 9)
u = mda.Universe.empty(64, trajectory=False)
u.load_new('a.h5md', convert_units=False)
assert u.trajectory.n_frames == 6 and u.trajectory.n_atoms == 64
for i, ts in enumerate(u.trajectory):
    assert np.abs(ts.positions - d[i, :, 3:6]).max() < 1e-6  # single precision there
    assert np.abs(ts.velocities - d[i, :, 6:9]).max() < 1e-5
    assert ts.dimensions is None and abs(ts.time - 0.02 * i) < 1e-6
w = h5py.File('w.h5', 'r')
assert w['particles/circle/position/value'].shape[1:] == (1, 3)
assert 'velocity' not in w['particles/circle'] and 'velocity' in w['particles/cloth']
assert w[w['connectivity/cloth'].attrs['particles_group']] == w['particles/cloth']
assert 'kinetic_energy' in w['observables/cloth']
)py");
  INFO(read.err);
  CHECK(read.code == 0);
}

TEST_CASE("what is exported as H5MD comes back as the same scene") {
  need_hdf5();
  const Here here;
  const auto same = [&](const Words& scene, const Words& run) {
    INFO(scene[0]);
    Words words{"export"};
    words.insert(words.end(), scene.begin(), scene.end());
    words.insert(words.end(), {"--format", "h5md", "-q", "a.h5"});
    const Outcome made = here.sim(words);
    INFO(made.err);
    REQUIRE(made.code == 0);
    const Outcome back = here.sim({"import", "a.h5", "--out", "a.lua"});
    INFO(back.err);
    REQUIRE(back.code == 0);
    words = scene;
    words.insert(words.end(), run.begin(), run.end());
    words.insert(words.end(), {"-q", "--no-verify", "--dump=mine.csv"});
    REQUIRE(here.sim(words).code == 0);
    words = {"a.lua"};
    words.insert(words.end(), run.begin(), run.end());
    words.insert(words.end(), {"-q", "--no-verify", "--dump=theirs.csv"});
    const Outcome again = here.sim(words);
    INFO(again.err);
    REQUIRE(again.code == 0);
    return read_text(here("mine.csv")) == read_text(here("theirs.csv"));
  };
  CHECK(same({"scenes/cloth.lua"}, {"-T", "0.5"}));
  CHECK(same({"scenes/cloth.lua", "-s", "n=5", "-i", "verlet", "-d", "0.002"}, {"-n", "100"}));
  CHECK(same({"scenes/pendulum.lua"}, {"-T", "1"}));
  // A run that goes on: positions and velocities of its start.
  REQUIRE(here.sim({"-q", "-T", "0.5", "--snap", "s.snap", "--dump=d.csv"}).code == 0);
  REQUIRE(here.sim({"export", "scenes/cloth.lua", "--resume", "s.snap", "--format", "h5md", "-q",
                    "a.h5"})
              .code == 0);
  REQUIRE(here.sim({"import", "a.h5", "--out", "a.lua"}).code == 0);
  REQUIRE(here.sim({"a.lua", "-n", "0", "-q", "--dump=e.csv"}).code == 0);
  const auto mine = lines_of(read_text(here("d.csv"))), theirs = lines_of(read_text(here("e.csv")));
  REQUIRE(theirs.size() == 65);
  const auto state = [](const std::string& row) {
    return row.substr(row.find(',', row.find(',') + 1));
  };
  for (std::size_t i = 1; i < 65; ++i) CHECK(state(theirs[i]) == state(mine[mine.size() - 65 + i]));
  // Parts missing from a file are reported.
  REQUIRE(here.sim({"export", "scenes/cloth_ball.lua", "--format", "h5md", "-q", "b.h5"}).code ==
          0);
  CHECK_THAT(here.sim({"import", "b.h5", "--out", "b.lua"}).err,
             Contains("note: not in the file: collider 'sphere'"));
}

TEST_CASE("H5MD of other programs becomes a scene, and what it lacks is said") {
  need_h5py();
  const Here here;
  const Outcome made = here.python(R"py(
import h5py, numpy as np
f = h5py.File('a.h5', 'w')
f.create_group('h5md').attrs['version'] = [1, 0]
for name, shift in [('left', 0), ('right', 5)]:
    g = f.create_group('particles/' + name)
    g.create_group('box').attrs['boundary'] = ['periodic'] * 3
    last = [[0, 0, 0], [1, 0, 0], [1 + shift, 2, 0]]
    g['position/value'] = np.array([[[9, 9, 9]] * 3, last], 'f4')
    g['position/value'].attrs['unit'] = 'nm'
    g['id/value'] = np.array([[7, 8, 9], [9, 8, 7]])
c = f.create_dataset('connectivity/bonds', data=np.array([[9, 7]]))
c.attrs['particles_group'] = f['particles/right'].ref
f['connectivity/angles'] = np.array([[7, 8, 9]])
)py");
  INFO(made.err);
  REQUIRE(made.code == 0);
  const Outcome back = here.sim({"import", "a.h5", "--out", "a.lua"});
  INFO(back.err);
  REQUIRE(back.code == 0);
  CHECK_THAT(back.err, Contains("no masses") && Contains("is in nm") && Contains("periodic") &&
                           Contains("ties of 'bonds' are springs of 100 N/m"));
  const Outcome run = here.sim({"a.lua", "-n", "0", "-q", "--dump"});
  INFO(run.err);
  REQUIRE(run.code == 0);
  CHECK_THAT(run.out, Contains("left,0,0,2,1,2,0,0,0,0") && Contains("right,0,0,2,6,2,0,0,0,0"));
  CHECK_THAT(here.sim({"adjacency", "a.lua", "0"}).out + here.sim({"a.lua", "-n", "0"}).out,
             Contains("bonds"));
}

TEST_CASE("H5MD files that are damaged or made to harm are refused") {
  need_h5py();
  const Here here;
  const auto refused = [&](const std::string& change, const std::string& why) {
    INFO(change);
    const Outcome made = here.python(
        "import h5py, numpy as np\n"
        "f = h5py.File('a.h5', 'w')\n"
        "f.create_group('h5md').attrs['version'] = [1, 1]\n"
        "g = f.create_group('particles/all')\n"
        "x = np.array([[[0., 0, 0], [1, 0, 0]]])\n"
        "def put(name, data):\n"
        "    if name in f: del f[name]\n"
        "    f[name] = data\n"
        "put('particles/all/position/value', x)\n" +
        change);
    INFO(made.err);
    REQUIRE(made.code == 0);
    const Outcome outcome = here.sim({"import", "a.h5", "--out", "a.lua"});
    CHECK(outcome.code == 2);
    CHECK_THAT(outcome.err, Contains("sim: error: bad H5MD file: a.h5: ") && Contains(why));
    CHECK_FALSE(fs::exists(here("a.lua")));
  };
  const std::string at = "'particles/all/position/value'";
  refused("f['h5md'].attrs['version'] = [2, 0]", "layout of H5MD, version 1");
  refused("del f['h5md']", "layout of H5MD");
  refused("del f['particles']", "no particles");
  refused("del f['particles/all']", "no particles");
  refused("del f['particles/all/position']", "no positions");
  refused("put(" + at + ", x[:, :, :2])", "three numbers");
  refused("put(" + at + ", np.array([[['a', 'b', 'c']]], 'S'))", "no numbers");
  refused("put(" + at + ", x[:0])", "empty");
  refused("put(" + at + ", x * np.nan)", "not finite");
  refused("put('particles/all/mass', [1., 0])", "mass is not positive");
  refused("put('particles/all/mass', [1., 1, 1])", "differ in length");
  refused("put('particles/all/velocity/value', x[:, :1])", "differ in length");
  refused("put('particles/all/id', [3, 3])", "twice");
  refused("put('connectivity/b', [[0, 2]])", "not there");
  refused("put('connectivity/b', [[1, 1]])", "to itself");
  refused("put('parameters/sim/all/pinned', [2])", "pins a particle");
  refused(
      "put('parameters/sim/all/pinned', [0]); p = f['parameters/sim/all']\n"
      "p.attrs['drag'] = -1.",
      "no drag");
  // Stiffness or rest length alone below 0, or not finite.
  for (const std::string values :
       {"[-1.], [1.]", "[1.], [-1.]", "[np.nan], [1.]", "[1.], [np.inf]", "[-np.inf], [1.]"})
    refused(
        "put('connectivity/b', [[0, 1]])\n"
        "for name, value in zip(['stiffness', 'rest'], (" +
            values +
            ")):\n"
            "    put('parameters/sim/all/spring_' + name, value)",
        "a stiffness or rest length below 0");
  refused("del f[" + at + "]; f[" + at + "] = h5py.ExternalLink('/etc/passwd', '/x')",
          "link to elsewhere");
  refused("del f[" + at + "]; f[" + at + "] = h5py.SoftLink('/h5md')", "link to elsewhere");
  refused(
      "del f[" + at +
          "]\n"
          "g.create_dataset('position/value', (1, 2, 3), 'f8', external=[('/etc/passwd', 0, 48)])",
      "other files");
  refused("del f[" + at +
              "]\n"
              "v = h5py.VirtualLayout((1, 2, 3), 'f8'); v[0] = h5py.VirtualSource('b.h5', 'x', (2, "
              "3))\n"
              "g.create_virtual_dataset('position/value', v)",
          "other files");
  refused("del f[" + at +
              "]\n"
              "g.create_dataset('position/value', (1, 2**40, 3), 'f8', chunks=(1, 1, 3))",
          "too large");

  // A name that is Lua stays a name.
  const Outcome named = here.python(
      "import h5py, numpy as np\nf = h5py.File('a.h5', 'w')\n"
      "f.create_group('h5md').attrs['version'] = [1, 1]\n"
      "g = f.create_group('particles/x\"] = os.exit(7) --\\n')\ng['position'] = np.zeros((1, "
      "3))\n");
  REQUIRE(named.code == 0);
  REQUIRE(here.sim({"import", "a.h5", "--out", "n.lua"}).code == 0);
  CHECK(here.sim({"n.lua", "-n", "1", "-q"}).code == 0);
  CHECK_THAT(read_text(here("n.lua")), Contains("systems[\"x__ _ os.exit_7_ --_\"]"));

  // A method of any characters stays one string, in which those that end it or hide are lines.
  std::string plain = "verlet";
  for (char c = 1; c < 127; ++c) plain += c < ' ' || c == '"' || c == '\\' ? '_' : c;
  plain += "_ _ }) os.exit(7) --";
  const Outcome method = here.python(
      "import h5py, numpy as np\nf = h5py.File('a.h5', 'w')\n"
      "f.create_group('h5md').attrs['version'] = [1, 1]\n"
      "f['particles/all/position'] = np.zeros((1, 3))\n"
      "f.create_group('parameters/sim/all').attrs['integrator'] = np.bytes_(\n"
      "    b'verlet' + bytes(range(1, 128)) + b' \" }) os.exit(7) --')\n");
  INFO(method.err);
  REQUIRE(method.code == 0);
  REQUIRE(here.sim({"import", "a.h5", "--out", "m.lua"}).code == 0);
  CHECK_THAT(read_text(here("m.lua")), Contains("integrator = \"" + plain + "\""));
  CHECK_THAT(here.sim({"m.lua", "-n", "1", "-q"}).err, Contains("unknown integrator"));
}

TEST_CASE("no damage to an H5MD file ends the program otherwise than in words") {
  need_hdf5();
  const Here here;
  REQUIRE(here.sim({"-q", "-s", "n=3", "-T", "0.02", "--out", "a.h5"}).code == 0);
  const std::string whole = read_text(here("a.h5"));
  REQUIRE(whole.size() > 10000);
  const auto tried = [&](const std::string& bytes) {
    write_text(here("b.h5"), bytes);
    const Outcome outcome = here.sim({"import", "b.h5"});
    CHECK((outcome.code == 0 || outcome.code == 2));
    if (outcome.code == 2) CHECK_THAT(outcome.err, Contains("sim: error: bad H5MD file: b.h5: "));
    return outcome.code;
  };
  CHECK(tried("") == 2);
  CHECK(tried("no HDF5") == 2);
  for (std::size_t part = 1; part < 8; ++part)
    CHECK(tried(whole.substr(0, whole.size() * part / 8)) == 2);
  std::uint32_t random = 12345;
  for (int round = 0; round < 60; ++round) {
    std::string bytes = whole;
    for (int flips = 0; flips < 8; ++flips) {
      random = random * 1664525 + 1013904223;
      bytes[(random >> 8) % (round % 2 ? 4096 : bytes.size())] ^=
          static_cast<char>(1 << (random & 7));
    }
    tried(bytes);
  }
}

TEST_CASE("H5MD files of worlds, checks of names, and what cannot be written") {
  need_hdf5();
  const Here here;
  const auto refused = [&](const Words& words, int code, const std::string& why) {
    const Outcome outcome = here.sim(words);
    INFO(outcome.err);
    CHECK(outcome.code == code);
    CHECK_THAT(outcome.err, Contains(why));
    CHECK(files_in(here.folder.path()) == 0);
  };
  refused({"--out", "no/such/a.h5"}, 5, "cannot write");
  refused({"export", "scenes/cloth.lua", "--format", "h5md", "a"}, 2, ".h5");
  refused({"export", "scenes/cloth.lua", "--format", "h5md", "a.h5", "-T", "1"}, 2, "--out run.h5");
  refused({"import", "a.h5"}, 5, "No such file");
  write_text(here("flat.lua"),
             "local sim = require 'sim'\nreturn sim.scene { name = 'f', state = { 1, 0 },\n"
             "  field = sim.field.lua { function(t, x) return { x[2], -x[1] } end },\n"
             "  integrator = 'rk4', dt = 0.1, duration = 1 }\n");
  const Outcome flat = here.sim({"flat.lua", "--out", "a.h5"});
  CHECK(flat.code == 2);
  CHECK_THAT(flat.err, Contains("list of numbers"));
  const Outcome stopped =
      here.sim({"-q", "--out", "a.h5", "-i", "euler", "-d", "0.02", "-T", "20"});
  CHECK(stopped.code == 4);
  CHECK(files_in(here.folder.path()) == 3);
}

// The system's word for EFBIG, alone: neither the library's sentence around it nor nothing.
TEST_CASE("H5MD files that find no room say so, wherever it ends") {
  need_hdf5();
  const Here here;
  ProgramOptions shell = here.options;
  shell.program = "/bin/sh";
  for (const char* const blocks : {"2", "60", "200", "400"}) {  // of 512 bytes
    INFO(blocks);
    const Outcome full = run_sim({"-c", std::string("ulimit -f ") + blocks + "; exec '" +
                                            SIM_BINARY + "' -q -T 0.5 --out a.h5"},
                                 shell);
    CHECK(full.code == 5);
    CHECK(full.err ==
          "sim: error: cannot write: a.h5: File too large; check the folder, its permissions and "
          "the space there\n");
    CHECK(files_in(here.folder.path()) == 0);
  }
}

}  // namespace sim_test
