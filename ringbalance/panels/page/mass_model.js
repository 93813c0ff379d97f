// A run of the exported strategy and plant, sample by sample, as the program runs two eccentric masses.
import { digits } from "./controls.js";
import { plant, strategy } from "./mass_blocks.js";
import { normalPairs } from "./numbers.js";

/** Every slider, as `CONTROLS` of the ring's page; `added`: a change is added to a drawn device's own value, else it is a factor. */
export const MASS_CONTROLS = {
  imbalance: { group: "Rotor", label: "Imbalance", unit: "g m", si: 1e-3 },
  phase: { group: "Rotor", label: "Direction of the imbalance", unit: "deg", si: Math.PI / 180, added: true },
  arm_1: { group: "Rotor", label: "Friction arm of mass 1", unit: "mm", si: 1e-3 },
  arm_2: { group: "Rotor", label: "Friction arm of mass 2", unit: "mm", si: 1e-3 },
  noise: { group: "Rotor", label: "Sensor noise, times the scene's", unit: "", si: 1, note: "of vibration and encoders; the filters assume the scene's" },
  limit: { group: "Strategy", label: "Limit of the vibration", unit: "um", si: 1e-6, log: true },
  wait: { group: "Strategy", label: "Wait after a move", unit: "s", si: 1, note: "for the vibration to become steady" },
  drive_speed: { group: "Strategy", label: "Drive speed for friction", unit: "rpm", si: Math.PI / 30, log: true },
};
export const MASS_SPEEDS = [1, 2, 5, 10, 20, 60];
const LOCKED = 2; // flag of a mass in the plant's row
const INSTANTS = 8000; // of a run that are kept for pictures
const FARTHEST = 1e3; // m; a run beyond has diverged

export const massSettings = ({ controls }) => Object.fromEntries(Object.entries(controls).map(([name, { range }]) => [name, range[2]]));

/** Constants of a block under settings; those of a device's own plant come first. */
export function constantsOf(kind, content, settings, device) {
  const block = kind === "plant" ? plant : strategy, c = Float64Array.from(block.NUMBERS.constants);
  if (kind === "plant") c.set(content.devices[device].constants);
  for (const [name, { of, places, range }] of Object.entries(content.controls)) {
    const value = settings[name], own = range[2];
    if (of !== kind || value === own) continue;
    for (const i of places) c[i] = MASS_CONTROLS[name].added ? c[i] + value - own : own ? (c[i] * value) / own : value;
  }
  return c;
}

export class MassRun {
  /** `noise(k)`: the k-th standard normal number; each sample takes eight, in the order of `SENSOR_NOISES`. */
  constructor(content, settings, { device = 0, seed = 1, noise = normalNumbers(seed) } = {}) {
    const own = content.devices[device], constants = constantsOf("plant", content, settings, device);
    const { row, angles, flags } = content.places, start = Float64Array.from(plant.NUMBERS.start);
    start.set(own.angles, angles);
    Object.assign(this, { content, settings, own, noise, samples: 0, since: Infinity, balanced: false, left: false, stages: [] });
    this.plant = new plant.Block({ constants, start });
    this.locked = new plant.Block({ constants, start });
    this.locked.w.fill(LOCKED, flags, flags + 2);
    this.strategy = new strategy.Block({ ...strategy.NUMBERS, constants: constantsOf("strategy", content, settings, device) });
    // Vibration of both axes, its velocity, angles and rates have the noise of one sensor each.
    this.inputs = Object.entries(strategy.INPUTS).map(([name, to], i) => ({ to, from: plant.OUTPUTS[name], sigma: i < 3 ? 0 : own.noise[(i - 3) >> 1] * (settings.noise ?? 0) }));
    this.every = Math.max(1, Math.round(content.samples / INSTANTS));
    this.trace = { time: [], x: [], y: [], angles: [[], []], torques: [[], []], voltages: [[], []], stage: [], energy: [], speed: [] };
    this.reference = { time: this.trace.time, x: [], y: [] };
    this.peaks = [0, 0];
    this.at = row;
  }

  get time() {
    return Math.max(0, this.samples - 1) * this.content.step;
  }

  get over() {
    return this.samples >= this.content.samples || this.diverged;
  }

  /** Time from the start of balancing until the vibration is within the limit for good; null if it is not, as the program judges. */
  get settled() {
    return this.left || this.diverged || this.since === Infinity ? null : Math.max(0, this.since - this.content.start);
  }

  /** Let the time to the next sample pass, and take it; the first at once. */
  advance() {
    const { content, strategy: control, own } = this, { w } = this.plant, { rates } = content.places;
    const step = this.samples ? content.step : 0;
    this.plant.advance(step);
    this.locked.advance(step);
    this.inputs.forEach(({ to, from, sigma }, i) => {
      control.w[to] = w[from] + (i < 3 ? 0 : sigma * this.noise(8 * this.samples + i - 3));
    });
    control.advance(step);
    this.samples += 1;
    const voltages = [1, 2].map((i) => control.w[strategy.OUTPUTS[`voltage_${i}`]]);
    voltages.forEach((voltage, i) => {
      const torque = own.drive[0] * voltage - own.drive[1] * w[rates + i];
      if (Math.abs(torque) > Math.abs(this.peaks[i])) this.peaks[i] = torque;
      w[plant.INPUTS[`voltage_${i + 1}`]] = voltage;
    });
    this.#judge(control.w[strategy.OUTPUTS.stage], content.causes[control.w[strategy.OUTPUTS.cause]]);
    if (this.samples % this.every === 0) this.keep();
  }

  /** The vibration now, m. */
  get amplitude() {
    return Math.hypot(this.plant.w[this.at], this.plant.w[this.at + 1]);
  }

  #judge(stage, cause) {
    const { amplitude, settings, stages, time } = this, name = this.content.stages[stage];
    this.cause = cause;
    this.diverged = !(amplitude < FARTHEST);
    if (stages.at(-1)?.name !== name) {
      stages.push({ name, time });
      this.keep();
    }
    if (amplitude > settings.limit) {
      this.since = Infinity;
      this.left ||= this.balanced;
      return;
    }
    this.since = Math.min(this.since, time);
    this.balanced ||= cause === "balanced" || cause === "speed_changed";
  }

  /** Keep this instant for the pictures; torques are the largest since the one before. */
  keep() {
    const { trace, reference, at, plant: { w }, locked, content, time } = this;
    if (trace.time.at(-1) === time) return;
    trace.time.push(time);
    trace.x.push(w[at]);
    trace.y.push(w[at + 1]);
    reference.x.push(locked.w[at]);
    reference.y.push(locked.w[at + 1]);
    [0, 1].forEach((i) => {
      trace.angles[i].push(w[content.places.angles + i]);
      trace.torques[i].push(this.peaks[i]);
      trace.voltages[i].push(w[plant.INPUTS[`voltage_${i + 1}`]]);
      this.peaks[i] = 0;
    });
    trace.stage.push(this.stages.at(-1)?.name ?? "");
    for (const name of ["energy", "speed"]) trace[name].push(w[plant.OUTPUTS[name]]);
  }
}

/** Standard normal numbers of a seed, one at a time. */
function normalNumbers(seed) {
  const pairs = normalPairs(seed);
  let [number, pair] = [-1, null];
  return (k) => {
    if (k >> 1 !== number) [number, pair] = [k >> 1, pairs(k >> 1)];
    return pair[k & 1];
  };
}

/** Text behind "#" for a state: what differs from the scene. */
export function massAddress({ settings, ...others }, { controls }) {
  const changed = Object.entries(controls).filter(([name, { range }]) => settings[name] !== range[2]);
  const parts = changed.map(([name]) => [name, digits(settings[name] / MASS_CONTROLS[name].si, 6)]);
  for (const [name, usual] of [["device", 0], ["seed", 1], ["speed", 1]]) if (others[name] !== usual) parts.push([name, others[name]]);
  return parts.map((part) => part.join("=")).join("&");
}

/** State of an address; a part that is unknown or out of range is left out. */
export function massState(text, content) {
  const state = { settings: massSettings(content), device: 0, seed: 1, speed: 1 };
  for (const part of String(text).replace(/^#/, "").slice(0, 500).split("&")) {
    const [name, written] = part.split("="), value = Number(written);
    if (!/^\d{1,9}(\.\d{1,9})?$/.test(written ?? "")) continue;
    if (Object.hasOwn(content.controls, name)) {
      const { range: [low, high] } = content.controls[name], si = value * MASS_CONTROLS[name].si;
      if (si >= low * (1 - 1e-3) && si <= high * (1 + 1e-3)) state.settings[name] = si;
    } else if (name === "device" && Number.isInteger(value) && value < content.devices.length) state.device = value;
    else if (name === "seed" && Number.isInteger(value) && value > 0 && value < 1e6) state.seed = value;
    else if (name === "speed" && MASS_SPEEDS.includes(value)) state.speed = value;
  }
  return state;
}
