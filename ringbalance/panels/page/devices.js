// Drawn devices in workers, one device at a time each, so that new settings are taken up at once.
import { normalPairs, unpack } from "./numbers.js";
import { outcomeOf } from "./model.js";

const MOST_WORKERS = 4;
const NORMAL_95 = 1.959963984540054;

/** Lower and upper 95 % bound of a fraction, after Wilson, as `tune` gives them. */
export function bounds(count, of) {
  if (of === 0) return [0, 1];
  const p = count / of, z2 = NORMAL_95 ** 2 / of;
  const centre = (p + z2 / 2) / (1 + z2);
  const half = Math.sqrt(p * (1 - p) * z2 + z2 ** 2 / 4) / (1 + z2);
  return [Math.max(centre - half, 0), Math.min(centre + half, 1)];
}

/** Verdict on a fraction by its bounds, in the program's words. */
export const verdict = ({ low, high }, required) => (low >= required ? "met" : high < required ? "not met" : "undecided");

/** Summary of outcomes: how many settle in time, with bounds, and when; what stops the others. */
export function summary(outcomes, settlingTime) {
  const times = outcomes.map((each) => each.time).sort((a, b) => a - b), causes = new Map();
  const within = (part) => times[Math.max(Math.ceil(part * times.length * (1 - 1e-12)), 1) - 1] ?? Infinity;
  const count = times.filter((time) => time <= settlingTime).length;
  for (const { ended, time } of outcomes) {
    const cause = ended === "settled" && time > settlingTime ? "too_late" : ended;
    if (cause !== "settled") causes.set(cause, (causes.get(cause) ?? 0) + 1);
  }
  const [low, high] = bounds(count, times.length);
  return { count, of: times.length, low, high, half: within(0.5), most: within(0.9), causes: [...causes].sort((a, b) => b[1] - a[1]) };
}

/** Noise of a drawn device: its own for every seed. */
export const noiseOf = (seed, device) => normalPairs(seed * 1000 + device + 1);

/** Answers of a worker: it gets the content of the page, then devices with their settings. */
export function serve(scope) {
  let content, numbers;
  scope.onmessage = async ({ data }) => {
    if (data.content) {
      content = data.content;
      numbers = unpack(content.numbers, content.lengths);
      return;
    }
    const { job, settings, device, seed } = data;
    scope.postMessage({ job, outcome: outcomeOf(content, await numbers, settings, device, noiseOf(seed, device)) });
  };
}

/** Workers that run lists of devices, the first list first; `stop` forgets all that has not begun. */
export class DevicePool {
  constructor(source, content) {
    const address = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
    const count = Math.max(1, Math.min(MOST_WORKERS, (navigator.hardwareConcurrency ?? 2) - 1));
    Object.assign(this, { queue: [], jobs: new Map(), number: 0 });
    this.idle = Array.from({ length: count }, () => {
      const worker = new Worker(address);
      worker.postMessage({ content });
      worker.onmessage = ({ data }) => this.#take(worker, data);
      return worker;
    });
  }

  stop() {
    this.queue = [];
    this.jobs.clear();
  }

  /** Run devices under settings; `seen` is called with each outcome. */
  run(settings, devices, seed, seen) {
    const job = (this.number += 1);
    this.jobs.set(job, seen);
    this.queue.push(...devices.map((device) => ({ job, settings, device, seed })));
    while (this.idle.length && this.queue.length) this.idle.pop().postMessage(this.queue.shift());
  }

  #take(worker, { job, outcome }) {
    if (this.queue.length) worker.postMessage(this.queue.shift());
    else this.idle.push(worker);
    this.jobs.get(job)?.(outcome);
  }
}
