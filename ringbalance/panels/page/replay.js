// Runs that the program has traced, as the page carries them: see `_packed` in replay.py.

/** Every run of the packed numbers: `time`, s; `x`, `y`, m; `angles`, rad, and `torques`, N m, of each mass; and its facts. */
export async function unpackRuns({ numbers, runs, limit }) {
  const deflated = Uint8Array.from(atob(numbers), (character) => character.charCodeAt(0));
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream("deflate"));
  const view = new DataView(await new Response(stream).arrayBuffer());
  let at = 0;
  const series = (count, number) => Float64Array.from({ length: count }, () => ((at += 2), number(at - 2)));
  return runs.map((facts) => {
    const { count, end, middle, half, torque } = facts;
    const whole = (scale, shift = 0) => series(count, (place) => shift + (scale * view.getInt16(place, true)) / 32767);
    const halves = (scale) => series(count, (place) => scale * halfPrecision(view.getUint16(place, true)));
    return {
      ...facts,
      time: whole(end),
      angles: [0, 1].map((i) => whole(half[i], middle[i])),
      x: halves(limit),
      y: halves(limit),
      torques: [0, 1].map(() => halves(torque)),
    };
  });
}

/** Value of 16 bits as IEEE 754 reads them. */
export function halfPrecision(bits) {
  const exponent = (bits >> 10) & 31, fraction = bits & 1023;
  const size = exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15);
  return bits & 0x8000 ? -size : size;
}

/** Last instant at or before a time. */
export function instantAt({ time }, now) {
  let [low, high] = [0, time.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (time[middle] <= now) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** State of a run at a time, between two instants on the line between them; torques are those from the instant on. */
export function stateAt(run, now) {
  const i = instantAt(run, now), j = Math.min(i + 1, run.time.length - 1), span = run.time[j] - run.time[i];
  const part = span > 0 ? Math.min(Math.max((now - run.time[i]) / span, 0), 1) : 0;
  const between = (values) => values[i] + part * (values[j] - values[i]);
  return { x: between(run.x), y: between(run.y), angles: run.angles.map(between), torques: run.torques.map((each) => each[i]), stage: stageAt(run, now) };
}

/** Name of the stage at a time; a stage that ends as it begins is passed over. */
export function stageAt({ stages }, now) {
  return stages.findLast(([, start]) => start <= now)?.[0] ?? "";
}

/** Starts of the stages until a time, for a plot. */
export const stageMarks = ({ stages }, now) =>
  stages.filter(([, start], i) => start > 0 && start <= now && stages[i + 1]?.[1] !== start).map(([label, time]) => ({ time, label }));

/** Value at a time of a profile of times and values, linear between them. */
export function profileAt([times, values], now) {
  const i = times.findLastIndex((time) => time <= now);
  if (i < 0) return values[0];
  if (i === times.length - 1) return values[i];
  return values[i] + ((now - times[i]) / (times[i + 1] - times[i])) * (values[i + 1] - values[i]);
}

export const REPLAY_SPEEDS = [1, 2, 5, 10, 20, 60];

/** Text behind "#" for a state; empty at the beginning. */
export function replayAddress({ device, time, speed }) {
  const parts = [["device", device, 0], ["time", Number(time.toFixed(2)), 0], ["speed", speed, 5]];
  return parts.filter(([, value, usual]) => value !== usual).map(([name, value]) => `${name}=${value}`).join("&");
}

/** State of an address; a part that is unknown or out of range is left out. */
export function replayState(text, runs) {
  const state = { device: 0, time: 0, speed: 5 };
  for (const part of String(text).replace(/^#/, "").slice(0, 200).split("&")) {
    const [name, digits] = part.split("=");
    if (!/^\d{1,6}(\.\d{1,6})?$/.test(digits ?? "")) continue;
    const value = Number(digits);
    if (name === "device" && Number.isInteger(value) && value < runs.length - 1) state.device = value;
    if (name === "time") state.time = value;
    if (name === "speed" && REPLAY_SPEEDS.includes(value)) state.speed = value;
  }
  state.time = Math.min(state.time, runs[state.device].end);
  return state;
}
