// node sites.mjs KERNEL.wasm SITES: the places where a module calls its fused multiply-add, for
// which an engine that has an instruction for it may put that instead (fused() in load.mjs).
//
// SITES holds numbers in LEB128: twice the distance from the last place, plus 1 where the vectors
// are of floats.
import { readFileSync, writeFileSync } from "node:fs";

const bytes = readFileSync(process.argv[2]);
let at = 0;

function number() {
  for (let value = 0, shift = 0; ; shift += 7) {
    const byte = bytes[at++];
    value += (byte & 127) * 2 ** shift;
    if (byte < 128) return value;
  }
}
const skip = (count) => (at += count);
const text = () => {
  const length = number();
  skip(length);
  return bytes.toString("utf8", at - length, at);
};

// The operands of an instruction, by the binary format of WebAssembly (core specification 2.0, 5.4,
// with the exceptions that came before those of 3.0).
const memory = () => (number(), number());
const after = {
  0x02: number, 0x03: number, 0x04: number, 0x06: number, 0x07: number, 0x08: number,
  0x09: number, 0x0c: number, 0x0d: number, 0x10: number, 0x18: number, 0xd0: number, 0xd2: number,
  0x0e: () => { for (let n = number() + 1; n > 0; --n) number(); },
  0x11: memory,
  0x1c: () => skip(number()),
  0x3f: number, 0x40: number, 0x41: number, 0x42: number,
  0x43: () => skip(4),
  0x44: () => skip(8),
  0xfc: () => {
    const code = number(), operands = code < 8 ? 0 : [8, 10, 12, 14].includes(code) ? 2 : 1;
    for (let n = 0; n < operands; ++n) number();
  },
  0xfd: () => {
    const code = number();
    if (code < 12 || (code >= 84 && code <= 93)) memory();
    if (code === 12 || code === 13) skip(16);
    if ((code >= 21 && code <= 34) || (code >= 84 && code <= 91)) skip(1);
  },
};
for (let code = 0x20; code <= 0x26; ++code) after[code] = number;
for (let code = 0x28; code <= 0x3e; ++code) after[code] = memory;

// The index of each function of interest, from the exports.
function read_exports(kinds) {
  for (let n = number(); n > 0; --n) {
    const name = text(), kind = bytes[at++], index = number();
    if (kind === 0 && name === "sim_fma_doubles") kinds.set(index, 0);
    if (kind === 0 && name === "sim_fma_floats") kinds.set(index, 1);
  }
}

function read_code(kinds, found) {
  for (let n = number(); n > 0; --n) {
    const length = number(), end = at + length;
    for (let locals = number(); locals > 0; --locals) number(), skip(1);
    while (at < end) {
      const place = at, code = bytes[at++];
      if (code !== 0x10) { after[code]?.(); continue; }
      const kind = kinds.get(number());
      if (kind === undefined) continue;
      if (at - place < 3) throw Error("a call is shorter than the instruction");
      found.push([place, kind]);
    }
    if (at !== end) throw Error("a function does not end where it says");
  }
}

const kinds = new Map(), found = [];
for (at = 8; at < bytes.length; ) {
  const section = bytes[at++], length = number(), end = at + length;
  if (section === 7) read_exports(kinds);
  if (section === 10) read_code(kinds, found);
  at = end;
}
if (kinds.size !== 2) throw Error("the module does not export its fused multiply-add");

const packed = [];
let last = 0;
for (const [place, kind] of found) {
  let value = 2 * (place - last) + kind;
  for (; value >= 128; value = Math.floor(value / 128)) packed.push((value % 128) | 128);
  packed.push(value);
  last = place;
}
writeFileSync(process.argv[3], Uint8Array.from(packed));
console.log(`${found.length} places of a fused multiply-add`);
