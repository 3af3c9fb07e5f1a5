"""A recipe for spack, for packages/sim-laboratory/ of a repository of one's own."""
from spack.package import *


class SimLaboratory(CMakePackage):
    """A laboratory for mass-spring and particle simulation: which integrator, which step, and how
    wrong is the result?"""

    # The archive that ./dev deb makes: build/deb/source/.
    url = "file:///usr/src/sim_0.2.0.orig.tar.gz"

    license("MIT")

    version("0.2.0")

    variant("view", default=True, description="The live page of sim view")
    variant("hdf5", default=True, description="Files of H5MD")
    variant("petsc", default=False, description="The program sim-petsc")

    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("eigen@3.4:", type="build")
    depends_on("cli11@2.1:", type="build")
    depends_on("libedit")
    depends_on("zlib-api")
    depends_on("boost@1.70:", type="build", when="+view")
    depends_on("hdf5", when="+hdf5")
    depends_on("petsc+mpi", when="+petsc")
    depends_on("mpi", when="+petsc")

    # Compiled as C++, as no package of Lua is.
    resource(
        name="lua",
        url="https://www.lua.org/ftp/lua-5.4.4.tar.gz",
        sha256="164c7849653b80ae67bec4b7473b884bf5cc8d2dca05653475ec2ed27b9ebf61",
        placement="lua",
    )

    generator("ninja")

    def cmake_args(self):
        left_out = {"HDF5": "+hdf5", "PETSc": "+petsc", "Boost": "+view"}
        return [
            self.define("SIM_TESTS", False),
            self.define("SIM_LUA_SOURCE", join_path(self.stage.source_path, "lua", "src")),
        ] + [
            self.define("CMAKE_DISABLE_FIND_PACKAGE_" + name, not self.spec.satisfies(variant))
            for name, variant in left_out.items()
        ]

    def test_cloth(self):
        """a cloth falls, with the bits that it has on every machine"""
        said = Executable(self.prefix.bin.sim)("scenes/cloth.lua", "-q", "--json", output=str)
        assert "129f25ebe3e79c14" in said
