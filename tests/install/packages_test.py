"""The packages of Debian and the recipes of packaging/, as far as one build shows: one version, all
that is installed is in one package, the symbols are those of the interface, the bill of materials
names what is linked. ./dev deb builds and installs them.

usage: packages_test.py BUILD CMAKE
"""
import ast
import fnmatch
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD, CMAKE = sys.argv[1:]
failures = []


def check(true, *words):
    if not true:
        failures.append(" ".join(str(word) for word in words))


def text(name):
    return (ROOT / name).read_text()


def find(pattern, name):
    found = re.search(pattern, text(name), re.MULTILINE)
    check(found, f"{name} has no {pattern}")
    return found[1] if found else None


def versions_are_those_of_the_project():
    version = find(r"^project\(sim VERSION ([\d.]+)", "CMakeLists.txt")
    recipe = json.loads(text("packaging/vcpkg/vcpkg.json"))
    for name, found in {
            "packaging/debian/changelog": find(r"\A[^(]*\(([\d.]+)-", "packaging/debian/changelog"),
            "CITATION.cff": find(r"^version: (.*)$", "CITATION.cff"),
            "spack": find(r'^    version\("(.*)"\)$', "packaging/spack/package.py"),
            "conda-forge": find(r'set version = "(.*)"', "packaging/conda-forge/meta.yaml"),
            "nix": find(r'^  version = "(.*)";$', "packaging/nix/default.nix"),
            "vcpkg": recipe["version"]}.items():
        check(found == version, name, "has version", found, "the project", version)


def recipes_can_be_read():
    recipe = ast.parse(text("packaging/spack/package.py"))
    spack = next(each for each in recipe.body if isinstance(each, ast.ClassDef))
    check({each.name for each in spack.body if isinstance(each, ast.FunctionDef)} ==
          {"cmake_args", "test_cloth"}, "the recipe of spack has other functions")
    try:
        import jinja2
        import yaml

        words = {"compiler": lambda name: f"{name}_compiler", "stdlib": lambda name: name}
        conda = yaml.safe_load(jinja2.Template(text("packaging/conda-forge/meta.yaml"))
                               .render(**words))
        check(set(conda) == {"package", "source", "build", "requirements", "test", "about"},
              "conda-forge has other sections", set(conda))
    except ImportError as missing:
        print("the recipe of conda-forge is not read:", missing)
    if shutil.which("nix-instantiate"):
        subprocess.run(["nix-instantiate", "--parse", ROOT / "packaging/nix/default.nix"],
                       check=True, stdout=subprocess.DEVNULL)
    # Every option that a recipe gives is one of the build's.
    options = set(re.findall(r"(?:option|set)\((SIM_\w+)", text("CMakeLists.txt")))
    for name in ("spack/package.py", "conda-forge/meta.yaml", "nix/default.nix",
                 "vcpkg/portfile.cmake"):
        for option in re.findall(r"\bSIM_\w+", text(f"packaging/{name}")):
            check(option in options, name, "gives", option, "which the build does not know")


def recipes_take_one_lua():
    places = re.findall(r"lua-[\d.]+\.tar\.gz", "".join(
        text(f"packaging/{name}") for name in ("spack/package.py", "conda-forge/meta.yaml",
                                               "nix/default.nix", "vcpkg/portfile.cmake")))
    check(len(set(places)) == 1 and len(places) == 5, "recipes take Lua from", places)
    sums = set(re.findall(r"\b[0-9a-f]{64}\b", "".join(
        text(f"packaging/{name}") for name in ("spack/package.py", "conda-forge/meta.yaml",
                                               "nix/default.nix"))))
    check(len(sums) == 1, "recipes have checksums", sums)
    # Debian's archive is the one of Lua.
    for archive in (ROOT / "build/web/sources").glob("lua5.4_*.orig.tar.gz"):
        content = archive.read_bytes()
        check(sums == {hashlib.sha256(content).hexdigest()}, "other than", archive)
        check(hashlib.sha512(content).hexdigest() in text("packaging/vcpkg/portfile.cmake"),
              "vcpkg has another checksum than", archive)


# Patterns of packaging/debian/*.install by package, with the folders of one machine's libraries left out.
def patterns():
    found = {}
    for file in sorted((ROOT / "packaging/debian").glob("*.install")):
        for line in file.read_text().splitlines():
            if line and not line.startswith(("#", "build/", "usr/share/doc/")):
                found.setdefault(file.stem, []).append(
                    line.split()[0].replace("usr/lib/*/", "usr/lib/"))
    return found


def packages_share_out_what_is_installed(place):
    environment = {**os.environ, "DESTDIR": str(place)}
    subprocess.run([CMAKE, "--install", BUILD, "--prefix", "/usr"], env=environment, check=True,
                   stdout=subprocess.DEVNULL)
    installed = [str(each.relative_to(place)) for each in place.rglob("*")
                 if each.is_file() or each.is_symlink()]
    check(len(installed) > 300, "only", len(installed), "files are installed")
    used = set()
    for name in installed:
        parts = name.split("/")
        above = ["/".join(parts[:count]) for count in range(1, len(parts) + 1)]
        owners = set()
        for package, wanted in patterns().items():
            for pattern in wanted:
                if any(fnmatch.fnmatchcase(each, pattern) and each.count("/") == pattern.count("/")
                       for each in above):
                    owners.add(package)
                    used.add((package, pattern))
        check(len(owners) == 1, name, "is in the packages", sorted(owners))
    for package, wanted in patterns().items():
        for pattern in wanted:
            optional = re.search(r"read_h5md|window\.so|/web|view/", pattern)
            check((package, pattern) in used or optional, package, "finds no", pattern)


def symbols_are_those_of_the_interface():
    listed = set(re.findall(r"^ (sim_\w+)@SIM_1\.\d+ ", text("packaging/debian/libsim1.symbols"), re.MULTILINE))
    exported = set(re.findall(r"\b(sim_\w+);", text("core/c/sim.map")))
    check(listed == exported, "symbols differ:", listed ^ exported)


def the_bill_names_what_is_linked():
    bill = json.loads(subprocess.run([sys.executable, "-B", ROOT / "packaging/bill.py"], check=True,
                                     capture_output=True, text=True,
                                     env={**os.environ, "SOURCE_DATE_EPOCH": "0"}).stdout)
    check(bill["creationInfo"]["created"] == "1970-01-01T00:00:00Z", "it has its own date")
    names = [each["name"] for each in bill["packages"]]
    check(len(set(names)) == len(names) and names[0] == "sim", names)
    rows = set(re.findall(r"^\| [^|]+ \| `([^`]+)` \|", text("docs/licences.md"), re.MULTILINE))
    needs = set(re.findall(r"^ (lib[^ ,]+-dev)", text("packaging/debian/control").split("Indep:")[0],
                           re.MULTILINE))
    check(needs <= rows, "docs/licences.md does not name", needs - rows)
    for each in bill["packages"]:
        check(re.fullmatch(r"[A-Za-z0-9.-]+", each["licenseDeclared"]), each["name"],
              "has no licence by its SPDX name:", each["licenseDeclared"])
    if shutil.which("dpkg-query"):
        check("zlib1g-dev" in names, "the bill names", names)


def menus_can_show_it(place):
    for program, words, file in (
            ("desktop-file-validate", [], "usr/share/applications/sim.desktop"),
            ("appstreamcli", ["validate", "--no-net"], "usr/share/metainfo/sim.metainfo.xml")):
        if not shutil.which(program):
            print(file, "is not validated: needs", program)
            continue
        said = subprocess.run([program, *words, place / file], capture_output=True, text=True)
        check(said.returncode == 0, said.stdout, said.stderr)


with tempfile.TemporaryDirectory() as folder:
    versions_are_those_of_the_project()
    recipes_can_be_read()
    recipes_take_one_lua()
    packages_share_out_what_is_installed(pathlib.Path(folder))
    symbols_are_those_of_the_interface()
    the_bill_names_what_is_linked()
    menus_can_show_it(pathlib.Path(folder))
for failure in failures:
    print("packages:", failure)
print(f"packages: {len(failures)} failures")
sys.exit(bool(failures))
