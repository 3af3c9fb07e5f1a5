# nix-build packaging/nix: sim from this tree.
{ pkgs ? import <nixpkgs> { } }:

pkgs.stdenv.mkDerivation {
  pname = "sim";
  version = "0.2.0";
  src = pkgs.lib.cleanSource ../..;

  # Compiled as C++, as no package of Lua is.
  lua = pkgs.fetchurl {
    url = "https://www.lua.org/ftp/lua-5.4.4.tar.gz";
    sha256 = "164c7849653b80ae67bec4b7473b884bf5cc8d2dca05653475ec2ed27b9ebf61";
  };
  postUnpack = ''
    mkdir lua
    tar -xzf $lua -C lua --strip-components=1
    cmakeFlagsArray+=("-DSIM_LUA_SOURCE=$PWD/lua/src")
  '';

  nativeBuildInputs = with pkgs; [ cmake ninja pkg-config ];
  buildInputs = with pkgs; [ boost cli11 eigen hdf5 libedit zlib ];
  cmakeFlags = [
    "-DSIM_TESTS=OFF"
    "-DCMAKE_DISABLE_FIND_PACKAGE_PETSc=ON"
  ];

  doInstallCheck = true;
  installCheckPhase = ''
    $out/bin/sim scenes/cloth.lua --quiet --json | grep -q 129f25ebe3e79c14
  '';

  meta = {
    description = "Laboratory for mass-spring and particle simulation";
    license = pkgs.lib.licenses.mit;
    mainProgram = "sim";
    platforms = [ "x86_64-linux" "aarch64-linux" ];
  };
}
