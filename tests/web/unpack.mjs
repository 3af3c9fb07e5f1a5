// node unpack.mjs FOLDER: what the page unpacks its kernel with, against xz; a broken stream is
// refused.
import { execFileSync } from "node:child_process";
import { randomBytes } from "node:crypto";
import { readFileSync } from "node:fs";

const folder = process.argv[2];
const { LITERAL_BITS, unpacked_lzma } = await import(`${folder}/load.mjs`);
const module = new WebAssembly.Module(readFileSync(`${folder}/unpack.wasm`));
const packed = (bytes) => execFileSync("xz", ["--format=lzma", "--stdout",
  `--lzma1=preset=9e,lc=${LITERAL_BITS},lp=0,pb=0`],
  { input: bytes, maxBuffer: 2 ** 28 }).subarray(13);
const fail = (words) => { console.log(words); process.exit(1); };

// Literals alone; matches near and far, also of the last four distances; none at all.
const noise = randomBytes(300000), words = Buffer.from("a spring and a mass, ".repeat(5000));
const cases = {
  kernel: readFileSync(`${folder}/page.wasm`), noise, words, zeros: Buffer.alloc(1000000),
  far: Buffer.concat([noise, words, noise, noise.subarray(7, 999), words]),
  one: Buffer.from("x"), nothing: Buffer.alloc(0),
  rows: Buffer.from(Float64Array.from({ length: 20000 }, (_, i) => Math.fround(i / 7)).buffer),
};
for (const [name, bytes] of Object.entries(cases))
  if (Buffer.compare(Buffer.from(unpacked_lzma(module, packed(bytes), bytes.length)), bytes))
    fail(`${name} comes back as something else`);

// A page may be damaged: each way ends, and no byte is written elsewhere.
let refused = 0;
for (let i = 0; i < 400; ++i) {
  const broken = Buffer.from(packed(cases.words));
  broken[1 + (i * 7919) % (broken.length - 1)] ^= 1 << i % 8;
  try {
    const cut = broken.subarray(0, i % 2 ? broken.length : i);
    if (unpacked_lzma(module, cut, 105000).length !== 105000)
      fail("a broken stream has another length");
  } catch {
    ++refused;
  }
}
if (!refused) fail("no broken stream is refused");
console.log(`unpacked: ${Object.keys(cases).length} streams ok`);
