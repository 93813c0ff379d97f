// Outputs of a block for rows of doubles on standard input: [time, inputs ...]; a query of a law for each row.
//   node same_bits.mjs MODULE ROWS_OF_A_RUN <rows >outputs
import { readSync, writeSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [file, rowsOfARun] = process.argv.slice(2);
const { NUMBERS, INPUTS, OUTPUTS, Block, flow, moment, surface_radius } = await import(pathToFileURL(file).href);

/** All doubles of standard input. */
function doubles() {
    const parts = [];
    const buffer = Buffer.alloc(1 << 20);
    for (let size = 1; size > 0; ) {
        size = readSync(0, buffer);
        parts.push(Buffer.from(buffer.subarray(0, size)));
    }
    const bytes = Buffer.concat(parts);
    return new Float64Array(bytes.buffer, bytes.byteOffset, bytes.length / 8);
}

/** Velocity, regime, status, primed, moment and radius of queries of fill, opposite fill, pressure and primed. */
function answersOfLaw(rows) {
    const { constants, cells, pieces } = NUMBERS;
    const results = new Float64Array((rows.length / 4) * 6);
    for (let at = 0, to = 0; at < rows.length; at += 4, to += 6) {
        const told = flow(rows[at], rows[at + 2], rows[at + 1], rows[at + 3] !== 0);
        results[to] = told.velocity;
        results[to + 1] = told.regime;
        results[to + 2] = told.status;
        results[to + 3] = Number(told.primed);
        results[to + 4] = moment(constants, cells, pieces, rows[at]);
        results[to + 5] = surface_radius(constants, cells, pieces, rows[at]);
    }
    return results;
}

/** Outputs after each step of runs of so many steps, from rows of time and inputs. */
function outputsOfBlock(rows) {
    const inputs = Object.values(INPUTS);
    const outputs = Object.values(OUTPUTS);
    const width = inputs.length + 1;
    const results = new Float64Array((rows.length / width) * outputs.length);
    let block = new Block();
    for (let at = 0, to = 0; at < rows.length; at += width) {
        if (at % (width * Number(rowsOfARun)) === 0) block = new Block();
        for (let i = 0; i < inputs.length; i++) block.w[inputs[i]] = rows[at + 1 + i];
        block.advance(rows[at]);
        for (const index of outputs) results[to++] = block.w[index];
    }
    return results;
}

const bytes = new Uint8Array((flow ? answersOfLaw : outputsOfBlock)(doubles()).buffer);
for (let at = 0; at < bytes.length; ) at += writeSync(1, bytes, at);
