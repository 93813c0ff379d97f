// Numbers of the blocks as the page carries them: see `packed_blocks` in devices.py.

const KINDS = [[Float64Array, 1], [Uint8Array, 1], [Float32Array, 8], [Float64Array, 8], [Float64Array, 1]];
const NAMES = ["constants", "cells", "pieces", "levels", "start"];

/** Arrays of every block. Tables are row by row, as the exported functions read them. */
export async function unpack(text, lengths) {
  const deflated = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  let at = 0;
  return lengths.map((counts) => {
    const block = {};
    counts.forEach((rows, number) => {
      const [Kind, columns] = KINDS[number];
      const size = rows * columns, width = Kind.BYTES_PER_ELEMENT;
      const plain = new Uint8Array(size * width);
      for (let i = 0; i < size; i++) {
        const element = columns * (i % rows) + Math.floor(i / rows);
        for (let j = 0; j < width; j++) plain[element * width + j] = bytes[at + j * size + i];
      }
      at += size * width;
      block[NAMES[number]] = new Kind(plain.buffer);
    });
    return block;
  });
}

/** Standard normal numbers of a seed: the k-th pair is the same whichever others were asked for. */
export function normalPairs(seed) {
  return (k) => {
    const [a, b] = [uniform(seed, 2 * k), uniform(seed, 2 * k + 1)];
    const radius = Math.sqrt(-2 * Math.log(a));
    return [radius * Math.cos(2 * Math.PI * b), radius * Math.sin(2 * Math.PI * b)];
  };
}

/** A number in (0, 1) by seed and counter, with the mixing function of MurmurHash3 (A. Appleby, public domain). */
function uniform(seed, counter) {
  let h = (Math.imul(seed + 1, 0x9e3779b1) ^ Math.imul(counter + 1, 0x85ebca6b)) | 0;
  for (let i = 0; i < 2; i++) {
    h = Math.imul(h ^ (h >>> 16), 0x85ebca6b);
    h = Math.imul(h ^ (h >>> 13), 0xc2b2ae35);
    h = (h ^ (h >>> 16)) + 0x27d4eb2f;
  }
  return ((h >>> 0) + 0.5) / 4294967296;
}
