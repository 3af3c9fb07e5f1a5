// The registry: what it finds, when it opens it, and what it says of libraries it cannot use.
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>

#include "core/base/error.h"
#include "core/plugin/registry.h"
#include "tests/support/temporary.h"

namespace {

namespace fs = std::filesystem;
using Catch::Matchers::Contains;

fs::path fixture(const std::string& name) {
  return fs::path(SIM_FIXTURE_DIR) / name / (name + ".so");
}

// The error of an action; fails the test when there is none of that kind.
template <class Action>
sim::ErrorText error_of(sim::ErrorKind kind, Action action) {
  try {
    action();
  } catch (const sim::Error& error) {
    CHECK(error.kind() == kind);
    return error.text();
  }
  FAIL("no error");
  return {};
}

// The refusal of load(), which must name the file.
std::string refusal(const fs::path& file) {
  sim::Registry registry({SIM_PLUGIN_DIR});
  const sim::ErrorText text = error_of(sim::ErrorKind::kPlugin, [&] { registry.load(file); });
  CHECK_THAT(text.where, Contains(file.filename().string()));
  // A refused library leaves a registry that works.
  CHECK(registry.get<sim::Force>("gravity").name == "gravity");
  return text.why;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

}  // namespace

TEST_CASE("names are known without opening anything") {
  unsetenv("SIM_FIXTURE_RAN");
  sim::Registry registry({SIM_PLUGIN_DIR, fs::path(SIM_FIXTURE_DIR) / "noticed"});
  const auto forces = registry.names<sim::Force>();
  for (const char* name : {"gravity", "drag", "spring", "noticed"})
    CHECK(std::count(forces.begin(), forces.end(), name) == 1);
  CHECK(std::is_sorted(forces.begin(), forces.end()));
  CHECK(registry.names<sim::Field>() == std::vector<std::string>{"formula", "lua", "rotation"});
  CHECK(registry.get<sim::Force>("gravity").name == "gravity");
  CHECK(getenv("SIM_FIXTURE_RAN") == nullptr);

  SECTION("the name opens the library") {
    CHECK(registry.get<sim::Force>("noticed").name == "noticed");
    CHECK(getenv("SIM_FIXTURE_RAN") != nullptr);
  }
}

TEST_CASE("aliases find the plugin") {
  sim::Registry registry({SIM_PLUGIN_DIR, fs::path(SIM_FIXTURE_DIR) / "noticed"});
  CHECK(registry.get<sim::Integrator>("e").name == "euler");
  CHECK(registry.get<sim::Integrator>("t").name == "trapezoid");
  CHECK(registry.get<sim::Integrator>("r").name == "rk4");
  CHECK(&registry.get<sim::Integrator>("r") == &registry.get<sim::Integrator>("rk4"));
  CHECK(registry.get<sim::Integrator>("rk4").aliases == std::vector<std::string>{"r"});
  CHECK(registry.get<sim::Force>("seen").name == "noticed");

  // Aliases are no names of their own.
  const auto names = registry.names<sim::Integrator>();
  CHECK(std::count(names.begin(), names.end(), "r") == 0);
}

TEST_CASE("every kind has a name, a folder and its place in the list") {
  std::set<std::string> words;
  for (std::uint32_t i = 0; i < sim::kPluginKinds.size(); ++i) {
    CHECK(sim::kPluginKinds[i].number == i);
    CHECK(words.emplace(sim::kPluginKinds[i].name).second);
    if (sim::kPluginKinds[i].folder != sim::kPluginKinds[i].name)  // as of views
      CHECK(words.emplace(sim::kPluginKinds[i].folder).second);
  }
  CHECK(sim::kind_of<sim::Force>.name == "force");
  CHECK(sim::kind_of<sim::Collider>.folder == "colliders");
}

TEST_CASE("find looks through all kinds") {
  sim::Registry registry({SIM_PLUGIN_DIR});
  REQUIRE(registry.find("spring").size() == 1);
  CHECK(registry.find("spring")[0]->kind == sim::kind_of<sim::Force>);
  CHECK(registry.find("rotation")[0]->kind == sim::kind_of<sim::Field>);
  CHECK(registry.find("t")[0]->name == "trapezoid");
  CHECK_THAT(registry.find("t")[0]->file, Contains("trapezoid.so"));
  CHECK(registry.find("nothing_of_that_name").empty());
  CHECK(registry.find(sim::kind_of<sim::Force>, "t") == nullptr);
  CHECK(registry.find(sim::kind_of<sim::Integrator>, "t")->name == "trapezoid");
}

TEST_CASE("an unknown name is an error of the scene with a suggestion") {
  sim::Registry registry({SIM_PLUGIN_DIR});
  const auto force =
      error_of(sim::ErrorKind::kScene, [&] { registry.get<sim::Force>("gravty", "a.lua:7"); });
  CHECK(force.where == "a.lua:7");
  CHECK_THAT(force.what, Contains("gravty"));
  CHECK_THAT(force.remedy, Contains("gravity") && Contains("--load") && Contains("--plugin-path"));
  const auto method =
      error_of(sim::ErrorKind::kScene, [&] { registry.get<sim::Integrator>("qqqqqqqq"); });
  for (const char* name : {"euler", "trapezoid", "rk4"}) CHECK_THAT(method.remedy, Contains(name));
  // A name of another kind is unknown.
  error_of(sim::ErrorKind::kScene, [&] { registry.get<sim::Field>("gravity"); });
}

TEST_CASE("a library is judged by its card before any of its code runs") {
  unsetenv("SIM_FIXTURE_RAN");
  CHECK_THAT(refusal(fixture("wrong_magic")), Contains("magic"));
  CHECK_THAT(refusal(fixture("wrong_abi")), Contains("ABI 4711"));
  CHECK_THAT(refusal(fixture("wrong_size")), Contains("size"));
  CHECK_THAT(refusal(fixture("no_card")), Contains("no plugin card"));
  CHECK_THAT(refusal(fixture("duplicate")), Contains("'gravity' is taken by"));
  CHECK(getenv("SIM_FIXTURE_RAN") == nullptr);
}

TEST_CASE("a library that breaks its promises is refused with the reason") {
  CHECK_THAT(refusal(fixture("no_register")), Contains("sim_plugin_register"));
  CHECK_THAT(refusal(fixture("undeclared")),
             Contains("it registers the force 'stowaway', which its card does not name"));
  CHECK_THAT(refusal(fixture("forgotten")), Contains("missing_force"));
  CHECK_THAT(refusal(fixture("wrong_kind")),
             Contains("it registers the force 'wrong_kind', which its card does not name"));
  CHECK(refusal(fixture("bad_default")) ==
        "force 'bad_default': the default of the parameter 'k' is '1', not a number");
  CHECK_THAT(refusal(fixture("throws")), Contains("the cat sat on the licence server"));
  CHECK_THAT(refusal(fixture("throws_number")), Contains("registration failed"));
  CHECK_THAT(refusal(fixture("unresolved")), Contains("sim_fixture_function_that_does_not_exist"));
}

TEST_CASE("files that are no plugin libraries are refused") {
  const sim_test::TemporaryFolder folder;
  const fs::path file = folder.path() / "odd.so";
  SECTION("missing") { CHECK_FALSE(refusal(file).empty()); }
  SECTION("a folder") {
    fs::create_directory(file);
    CHECK_FALSE(refusal(file).empty());
  }
  SECTION("empty") {
    write(file, "");
    CHECK_FALSE(refusal(file).empty());
  }
  SECTION("text") {
    write(file, std::string(5000, 'x'));
    CHECK_THAT(refusal(file), Contains("not a shared library"));
  }
  SECTION("cut off") {
    // Whatever is missing, the answer is an error; a cut inside the code leaves no section table.
    const std::string whole = bytes_of(fixture("noticed"));
    REQUIRE(whole.size() > 4096);
    for (std::size_t size = 1; size < whole.size(); size += whole.size() / 37) {
      INFO(size);
      // A new file each time: one that was opened stays in memory as it is on the disk.
      const fs::path part = folder.path() / ("part" + std::to_string(size) + ".so");
      write(part, whole.substr(0, size));
      CHECK_FALSE(refusal(part).empty());
    }
  }
  SECTION("other kinds of ELF files") {
    // Elf64_Ehdr: the class is byte 4, the type byte 16, the size of a section's header byte 58.
    const std::string whole = bytes_of(fixture("noticed"));
    const std::pair<std::size_t, char> changes[] = {{0, 'e'}, {4, 1}, {16, 1}, {16, 2}, {58, 63}};
    for (const auto& [at, value] : changes) {
      std::string bytes = whole;
      bytes[at] = value;
      write(file, bytes);
      INFO(at << " " << int{value});
      CHECK(refusal(file) == "it is not a shared library of this machine");
    }
  }
  SECTION("headers that point nowhere") {
    // Bytes of the file header and of the table of sections falsified. The magic number is wrong
    // too, so that where the byte does not matter the answer is an error all the same.
    const std::string whole = bytes_of(fixture("wrong_magic"));
    std::uint64_t table = 0;
    std::memcpy(&table, whole.data() + 40, sizeof table);
    REQUIRE(table < whole.size());
    sim::Registry empty({});
    const auto check_byte = [&](std::size_t i) {
      std::string bytes = whole;
      bytes[i] = static_cast<char>(~bytes[i]);
      write(file, bytes);
      INFO(i);
      CHECK_FALSE(error_of(sim::ErrorKind::kPlugin, [&] { empty.load(file); }).why.empty());
    };
    for (std::size_t i = 0; i < 64; ++i) check_byte(i);
    for (std::size_t i = table; i < whole.size(); i += 5) check_byte(i);
  }
}

TEST_CASE("a broken library in a folder does not keep the others from being used") {
  const sim_test::TemporaryFolder folder;
  fs::create_directory(folder.path() / "forces");
  fs::copy_file(fixture("noticed"), folder.path() / "forces" / "noticed.so");
  fs::copy_file(fixture("wrong_abi"), folder.path() / "wrong_abi.so");
  fs::copy_file(fixture("forgotten"), folder.path() / "forgotten.so");
  write(folder.path() / "forces" / "words.so", "no library");
  write(folder.path() / "notes.txt", "not looked at");

  sim::Registry registry({folder.path()});
  CHECK(registry.get<sim::Force>("noticed").name == "noticed");
  REQUIRE(registry.rejected().size() == 2);
  CHECK_THAT(registry.rejected()[0], Contains("wrong_abi.so") && Contains("ABI 4711"));
  CHECK_THAT(registry.rejected()[1], Contains("words.so"));

  // Its card is good, so only its use tells.
  const auto text =
      error_of(sim::ErrorKind::kPlugin, [&] { registry.get<sim::Force>("forgotten"); });
  CHECK_THAT(text.where, Contains("forgotten.so"));
}

TEST_CASE("a name given twice is refused, and both files are named") {
  const fs::path own = fs::path(SIM_FIXTURE_DIR) / "duplicate";
  const auto folders = error_of(sim::ErrorKind::kPlugin, [&] {
    sim::Registry({own, SIM_PLUGIN_DIR});
  });
  CHECK_THAT(folders.where, Contains("forces/gravity.so"));
  CHECK_THAT(folders.why, Contains("'gravity' is taken by " + (own / "duplicate.so").string()));
  const auto loaded = error_of(sim::ErrorKind::kPlugin,
                               [&] { sim::Registry({SIM_PLUGIN_DIR}, {own / "duplicate.so"}); });
  CHECK_THAT(loaded.where, Contains("duplicate.so"));
  CHECK_THAT(loaded.why, Contains("forces/gravity.so"));

  const sim_test::TemporaryFolder folder;
  for (const char* name : {"b.so", "a.so"}) fs::copy_file(fixture("noticed"), folder.path() / name);
  const auto copies = error_of(sim::ErrorKind::kPlugin, [&] { sim::Registry({folder.path()}); });
  CHECK_THAT(copies.where, Contains("b.so"));
  CHECK_THAT(copies.why, Contains("a.so"));
}

TEST_CASE("one library found by several ways is one") {
  const sim_test::TemporaryFolder folder;
  const fs::path noticed = fs::path(SIM_FIXTURE_DIR) / "noticed";
  fs::create_symlink(noticed / "noticed.so", folder.path() / "link.so");
  sim::Registry registry({noticed, folder.path(), noticed}, {noticed / "noticed.so"});
  registry.load(folder.path() / "link.so");
  CHECK(registry.names<sim::Force>() == std::vector<std::string>{"noticed"});
  CHECK(registry.rejected().empty());
}

TEST_CASE("a default that does not fit its parameter is refused") {
  using sim::Param;
  using sim::ParamType;
  std::vector<Param> good = {{.name = "k", .default_value = std::int64_t{1}, .max = 1}};
  CHECK(sim::settle_defaults(good).empty());
  CHECK(std::get<double>(good[0].default_value) == 1);
  const auto wrong = [](std::vector<Param> params) { return sim::settle_defaults(params); };
  CHECK_THAT(wrong({{.name = "k", .default_value = std::string("1")}}),
             Contains("'k' is '1', not a number"));
  CHECK_THAT(wrong({{.name = "n", .type = ParamType::kInteger, .default_value = 1.5}}),
             Contains("not a whole number"));
  CHECK_THAT(wrong({{.name = "k", .default_value = -1.0, .min = 0}}), Contains("at least 0"));
  CHECK_THAT(wrong({{.name = "k"}, {.name = "k"}}), Contains("'k' is declared twice"));
}

TEST_CASE("a folder that is not there is an error") {
  const auto text = error_of(sim::ErrorKind::kIo, [] { sim::Registry({"/no/such/folder"}); });
  CHECK_THAT(text.where, Contains("/no/such/folder"));
}

TEST_CASE("registries know nothing of each other") {
  sim::Registry first({SIM_PLUGIN_DIR}), second({SIM_PLUGIN_DIR});
  first.load(fixture("noticed"));
  CHECK(first.find("noticed").size() == 1);
  CHECK(second.find("noticed").empty());
  CHECK(&first.get<sim::Force>("gravity") != &second.get<sim::Force>("gravity"));

  // The same library can serve both.
  second.load(fixture("noticed"));
  CHECK(second.get<sim::Force>("noticed").name == "noticed");
  // Twice in one is once.
  first.load(fixture("noticed"));
}

TEST_CASE("an empty registry has no plugins") {
  sim::Registry registry({});
  CHECK(registry.names<sim::Force>().empty());
  registry.load(fixture("noticed"));
  CHECK(registry.names<sim::Force>() == std::vector<std::string>{"noticed"});
}

TEST_CASE("a damaged library is refused before it is opened") {
  const sim_test::TemporaryFolder folder;
  const std::string whole = bytes_of(fixture("attraction"));
  const fs::path file = folder.path() / "attraction.so";
  unsetenv("SIM_FIXTURE_RAN");
  std::size_t refused = 0;
  for (std::size_t i = 0; i < 100; ++i) {
    std::string damaged = whole;
    damaged[(whole.size() - 60) * i / 100] ^= static_cast<char>(1 << i % 8);
    write(file, damaged);
    refused += refusal(file).empty() ? 0 : 1;
  }
  CHECK(refused == 100);
  write(file, whole + "x");
  CHECK_THAT(refusal(file), Contains("checksum"));
  // One without a checksum is as good as it ever was.
  write(file, whole.substr(0, whole.rfind("SIM-PLUGIN-MD5")));
  sim::Registry registry({SIM_PLUGIN_DIR});
  registry.load(file);
  CHECK(registry.get<sim::Force>("attraction").name == "attraction");
}
