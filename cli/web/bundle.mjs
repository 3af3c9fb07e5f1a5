// node bundle.mjs SOURCES BUILD: the page with the kernel in it, BUILD/page.html, for `sim export`
// to put a scene into.
import { readFileSync, writeFileSync } from "node:fs";
import { gzipSync } from "node:zlib";

const [sources, build] = process.argv.slice(2);
const text = (name) => readFileSync(`${sources}/${name}`, "utf8");
const packed = (bytes) => gzipSync(bytes, { level: 9 }).toString("base64");

const load = text("load.mjs").replaceAll(/^export /gm, "");
const worker = [load, readFileSync(`${build}/page.js`, "utf8"), text("worker.js")].join("\n");
const values = {
  STYLE: text("page.css"),
  PAGE: text("page.js"),
  KERNEL: packed(readFileSync(`${build}/page.wasm`)),
  SITES: readFileSync(`${build}/page.sites`).toString("base64"),
  WORKER: packed(worker),
};
const page = text("page.html").replaceAll(/@(STYLE|PAGE|KERNEL|SITES|WORKER)@/g,
  (_, name) => values[name]);
writeFileSync(`${build}/page.html`, page);
const size = (bytes) => `${(bytes / 1e6).toFixed(2)} MB`;
console.log(`the page has ${size(page.length)}, ${size(gzipSync(page).length)} gzipped`);
