// node bundle.mjs SOURCES BUILD: the page with the kernel in it, BUILD/page.html, for `sim export` to
// put a scene into; and BUILD/site/, where one page shows any scene: the kernel is a file beside it.
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { gzipSync } from "node:zlib";
import { LITERAL_BITS } from "./load.mjs";

const [sources, build] = process.argv.slice(2);
const text = (name) => readFileSync(`${sources}/${name}`, "utf8");
const packed = (bytes) => gzipSync(bytes, { level: 9 }).toString("base64");

const base64 = (name) => readFileSync(`${build}/${name}`).toString("base64");

// The bytes in LZMA, without the 13 that xz writes before them.
const lzma = (bytes) => execFileSync("xz", ["--format=lzma", "--stdout",
  `--lzma1=preset=9e,dict=16MiB,nice=273,lc=${LITERAL_BITS},lp=0,pb=0`],
  { input: bytes, maxBuffer: 2 ** 28 }).subarray(13).toString("base64");

const load = text("load.mjs").replaceAll(/^export /gm, "");
const worker = [load, readFileSync(`${build}/page.js`, "utf8"), text("worker.js")].join("\n");
const module = readFileSync(`${build}/page.wasm`);
const kernel = JSON.stringify({
  kernel: lzma(module),
  size: module.length,
  unpack: base64("unpack.wasm"),
  sites: base64("page.sites"),
  worker: packed(worker),
});
const page = (values) => text("page.html").replaceAll(/@([A-Z]+)@/g,
  (all, name) => ({ STYLE: text("page.css"), PAGE: text("page.js"), ...values })[name] ?? all);

const exported = page({ KERNEL: kernel, BESIDE: "" });
writeFileSync(`${build}/page.html`, exported);
const size = (bytes) => `${(bytes / 1e6).toFixed(2)} MB`;
console.log(`the page has ${size(exported.length)}, ${size(gzipSync(exported).length)} gzipped`);

mkdirSync(`${build}/site`, { recursive: true });
const NONCE = createHash("sha256").update(kernel).digest("hex").slice(0, 32);
const script = (name) => `<script nonce="${NONCE}" src="${name}"></script>\n`;
writeFileSync(`${build}/site/kernel.js`, `const SIM_KERNEL = ${kernel};\n`);
writeFileSync(`${build}/site/address.js`, text("address.js"));
writeFileSync(`${build}/site/index.html`, page({ NONCE, TITLE: "sim: a scene", KERNEL: "SIM_KERNEL",
  SCENE: "scene_of_address()",
  BESIDE: ["kernel.js", "scenes.js", "address.js"].map(script).join("") }));
