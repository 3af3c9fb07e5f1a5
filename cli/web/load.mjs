// How the module is made ready, in node and in the worker of a page.

// A module with f64x2.relaxed_madd and f32x4.relaxed_madd of its arguments.
const probe = Uint8Array.from(
  ("0061736d01000000010f0260037c7c7c017c60037d7d7d017d03030200010709020164000001660001" +
    "0a2b0214002000fd142001fd142002fd14fd8702fd21000b" +
    "14002000fd132001fd132002fd13fd8502fd1f000b").match(/../g),
  (byte) => parseInt(byte, 16));

// Whether this engine, on this machine, has a multiply-add that rounds once: (1 + e)(1 - e) - 1 is
// -e^2 then, and 0 where the product is rounded first.
export function rounds_once() {
  try {
    const { d, f } = new WebAssembly.Instance(new WebAssembly.Module(probe)).exports;
    const e = 2 ** -27, g = 2 ** -13;
    return d(1 + e, 1 - e, -1) === -e * e && f(1 + g, 1 - g, -1) === -g * g;
  } catch {
    return false; // it has no such instruction
  }
}

// The module with that instruction in the place of each call of the function that does its work:
// both take three vectors and give one, and what is left of the call is filled with nops.
export function fused(bytes, sites) {
  const changed = bytes.slice();
  let at = 0;
  for (let i = 0; i < sites.length; ) {
    let value = 0, shift = 0;
    do value += (sites[i] & 127) * 2 ** shift, shift += 7;
    while (sites[i++] > 127);
    at += Math.floor(value / 2);
    let end = at + 1;
    while (changed[end++] > 127);
    changed.fill(1, at, end);
    changed.set([0xfd, value % 2 ? 0x85 : 0x87, 0x02], at);
  }
  return changed;
}

export const LITERAL_BITS = 3; // lc of LZMA; lp and pb are 0

// The `size` bytes that a stream of LZMA stands for, by the module of unpack.cpp.
export function unpacked_lzma(module, packed, size) {
  const own = new WebAssembly.Instance(module).exports, { memory } = own;
  const decoder = memory.buffer.byteLength, from = decoder + own.unpack_room(),
    to = from + packed.length;
  memory.grow(Math.ceil((to + size - decoder) / 65536));
  new Uint8Array(memory.buffer).set(packed, from);
  own.unpack_begin(decoder, from, packed.length, to, size, LITERAL_BITS);
  let left;
  do left = own.unpack_more(decoder);
  while (left > 0);
  if (left < 0) throw Error("the kernel of this page is damaged");
  return new Uint8Array(memory.buffer, to, size);
}
