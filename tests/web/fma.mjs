// node fma.mjs FOLDER: the fused multiply-add of the module in software, and the instruction where
// this engine has one that rounds once, against rational numbers.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import v8 from "node:v8";

v8.setFlagsFromString("--experimental-wasm-relaxed-simd");
const folder = process.argv[2];
const { rounds_once } = await import(`${folder}/load.mjs`);
const module = new WebAssembly.Module(readFileSync(`${folder}/kernel.wasm`));
const kernel = await new Promise((resolve) => {
  createRequire(import.meta.url)(`${folder}/kernel.js`)({
    instantiateWasm(imports, done) {
      const instance = new WebAssembly.Instance(module, imports);
      resolve(instance.exports);
      done(instance, module);
      return {};
    },
  });
});

// Modules that call a function of three vectors on one lane: (x, y, z) => lane, by the import or by
// an instruction.
const bytes = (hex) => Uint8Array.from(hex.match(/../g), (byte) => parseInt(byte, 16));
function lanes(code) {
  const body = (splat, work, take) =>
    `00` + `2000fd${splat}2001fd${splat}2002fd${splat}` + work + `fd${take}000b`;
  const size = (hex) => (hex.length / 2).toString(16).padStart(2, "0");
  const parts = [body("14", code[0], "21"), body("13", code[1], "1f")];
  const section = (id, content) => id + size(content) + content;
  const imports = code[2] ? section("02", "02" + "016b016400" + "02" + "016b016600" + "02") : "";
  const first = code[2] ? 2 : 0;
  return bytes("0061736d01000000" +
    section("01", "03" + "60037c7c7c017c" + "60037d7d7d017d" + "60037b7b7b017b") + imports +
    section("03", "020001") + section("07", `020164000${first}0166000${first + 1}`) +
    section("0a", "02" + parts.map((part) => size(part) + part).join("")));
}
const instance = (code, imports) =>
  new WebAssembly.Instance(new WebAssembly.Module(lanes(code)), imports).exports;

// A finite double as m 2^e with whole numbers.
const view = new DataView(new ArrayBuffer(8));
function parts(x) {
  view.setFloat64(0, x);
  const bits = view.getBigUint64(0), e = Number((bits >> 52n) & 2047n), f = bits & 0xfffffffffffffn;
  const m = e ? f | 0x10000000000000n : f;
  return [bits >> 63n ? -m : m, (e || 1) - 1075];
}
// m 2^e rounded to nearest, ties to even, to a format of `digits` bits and least exponent `least`.
function rounded(m, e, digits, least, most) {
  const sign = m < 0n ? -1 : 1;
  let size = m < 0n ? -m : m;
  const length = size.toString(2).length, drop = Math.max(length - digits, least - e);
  if (drop > 0) {
    const cut = BigInt(drop), rest = size & ((1n << cut) - 1n), half = 1n << (cut - 1n);
    size >>= cut;
    if (rest > half || (rest === half && size & 1n)) ++size;
    e += drop;
  }
  let value = Number(size); // at most 53 bits
  for (; e > 0; --e) value *= 2;
  for (; e < 0; e += 500) value *= 2 ** Math.max(e, -500); // exact: it is representable
  return sign * (value > most ? Infinity : value);
}
function reference(a, b, c, digits, least, most) {
  if (![a, b].every(Number.isFinite)) return a * b + c;
  if (!Number.isFinite(c)) return c;
  const [ma, ea] = parts(a), [mb, eb] = parts(b), [mc, ec] = parts(c), e = Math.min(ea + eb, ec);
  const m = ((ma * mb) << BigInt(ea + eb - e)) + (mc << BigInt(ec - e));
  return m === 0n ? a * b + c : rounded(m, e, digits, least, most);
}

let state = 0x9e3779b97f4a7c15n;
const random = () => {
  state = (state * 6364136223846793005n + 1442695040888963407n) & 0xffffffffffffffffn;
  return Number(state >> 11n) / 2 ** 53;
};
const special = [0, -0, 1, -1, 0.5, 3, 2 ** -1074, 2 ** -1022, 1.7e308, Infinity, NaN, 2 ** -537,
  2 ** 512, 1 + 2 ** -52, 1 - 2 ** -53, 2 ** 53 + 2, 1e-300, 2 ** -149, 2 ** -126, 2 ** 127];
const some = (wide) => {
  if (random() < 0.1) return special[Math.floor(random() * special.length)];
  const bits = random() < 0.3 ? Math.floor(random() * 64) / 64 : random();
  return (random() < 0.5 ? -1 : 1) * (1 + bits) * 2 ** Math.floor((random() - 0.5) * wide);
};

function check(name, { d, f }) {
  let tried = 0;
  const same = (own, right, ...from) => {
    ++tried;
    if (!Object.is(own, right)) throw Error(`${name} of ${from}: ${own} instead of ${right}`);
  };
  for (let i = 0; i < 100000; ++i) {
    const wide = [8, 120, 2100][i % 3], a = some(wide), b = some(wide);
    const c = random() < 0.4 ? -a * b * (1 + (random() < 0.5 ? 0 : 2 ** -52)) : some(wide);
    same(d(a, b, c), reference(a, b, c, 53, -1074, Number.MAX_VALUE), a, b, c);
    const [x, y] = [a, b].map(Math.fround), z = Math.fround(random() < 0.3 ? -x * y : c);
    same(f(x, y, z), reference(x, y, z, 24, -149, 2 ** 128 - 2 ** 104), x, y, z);
  }
  console.log(`${name}: ${tried} numbers ok`);
}

check("in software", instance(["1000", "1001", true], {
  k: { d: kernel.sim_fma_doubles, f: kernel.sim_fma_floats } }));
if (rounds_once()) check("the instruction", instance(["fd8702", "fd8502", false], {}));
else console.log("this engine has no multiply-add that rounds once");
