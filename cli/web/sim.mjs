#!/usr/bin/env node
// sim, as a module of WebAssembly: node sim.mjs SCENE [OPTIONS]. It sees the files of the machine.
import { readFileSync, readdirSync, readSync, writeSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname } from "node:path";
import { fileURLToPath } from "node:url";
import v8 from "node:v8";
import { fused, rounds_once } from "./load.mjs";

v8.setFlagsFromString("--experimental-wasm-relaxed-simd"); // on by itself from node 22
const here = dirname(fileURLToPath(import.meta.url));
const exact = process.env.SIM_WEB === "exact" || !rounds_once();
const bytes = readFileSync(`${here}/kernel.wasm`);
const module = new WebAssembly.Module(
  exact ? bytes : fused(bytes, readFileSync(`${here}/kernel.sites`)));

// Bytes that were written, until a line ends.
function stream(file) {
  let line = [];
  return (byte) => {
    if (byte !== null) line.push(byte);
    if (byte !== null && byte !== 10 && line.length < 4096) return;
    const out = Uint8Array.from(line);
    for (let at = 0; at < out.length; ) at += writeSync(file, out, at);
    line = [];
  };
}
const out = stream(1), err = stream(2);
const input = Buffer.alloc(1);
const read = () => {
  try {
    return readSync(0, input, 0, 1) === 1 ? input[0] : null;
  } catch {
    return null;
  }
};

// Every folder of the machine under its own name, but for those that the module has itself.
function mount(FS, NODEFS) {
  for (const name of readdirSync("/")) {
    if (["dev", "proc", "sys", "sim"].includes(name)) continue;
    try {
      readdirSync(`/${name}`);
    } catch {
      continue;
    }
    if (!FS.analyzePath(`/${name}`).exists) FS.mkdir(`/${name}`);
    FS.mount(NODEFS, { root: `/${name}` }, `/${name}`);
  }
  FS.chdir(process.cwd());
}

const make = createRequire(import.meta.url)("./kernel.js");
await make({
  thisProgram: "/sim/bin/sim",
  instantiateWasm(imports, done) {
    done(new WebAssembly.Instance(module, imports), module);
    return {};
  },
  quit(code, status) {
    out(null), err(null);
    process.exitCode = code;
    throw status;
  },
  preRun: [(instance) => {
    instance.FS.init(read, out, err);
    instance.FS.mkdirTree("/proc/self");
    instance.FS.symlink("/sim/bin/sim", "/proc/self/exe");
    Object.assign(instance.ENV, process.env);
    delete instance.ENV.HOME; // plugins of the machine cannot be opened
    mount(instance.FS, instance.NODEFS);
  }],
}).then((instance) => instance.callMain(process.argv.slice(2)));
