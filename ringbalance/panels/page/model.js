// A run of the exported disc and controller, sample by sample, judged as the program judges its own runs.
import { disc, law_based, moment, target_vector, trial } from "./blocks.js";

const CONTROLLERS = { target_vector, trial, law_based };
const INSTANT = 1e-9;
export const PART = 0.02; // s, longest step of a run that is watched

/** The scene's settings of a page, SI. `integral` null: no integral part. `valve` -1: as the scene has it. */
export function sceneSettings(content) {
  const settings = { algorithm: content.algorithm, valve: -1, design: content.design, mass: true };
  for (const [name, range] of Object.entries(content.ranges)) settings[name] = range[2];
  return settings;
}

/** Constants and tables of a device's disc under settings. */
export function discOf(content, numbers, settings, device) {
  const facts = content.devices[device], at = content.places.disc, block = numbers[device];
  const scene = sceneSettings(content), c = Float64Array.from(block.constants);
  const valve = content.valves[settings.valve];
  if (valve) for (const [index, value] of Object.entries(valve.constants)) c[index] = value;
  if (settings.leak !== scene.leak) c[at.LEAK] = settings.leak * content.rules.leakPerConductance;
  const pressure = Math.max(facts.pressure + settings.pressure - scene.pressure, 0);
  if (settings.pressure !== scene.pressure) {
    c[at.SUPPLY] = c[at.SUPPLY] - facts.pressure + pressure;
    c[at.RESIDUAL] = leastFill(content, facts, settings.pressure, 1);
  }
  if (["amplitude", "phase", "runout"].some((name) => settings[name] !== scene[name])) {
    const size = settings.amplitude / scene.amplitude, turn = settings.phase - scene.phase;
    const [cosine, sine] = [size * Math.cos(turn), size * Math.sin(turn)];
    const [x, y] = facts.vibration, runout = scene.runout ? settings.runout / scene.runout : 0;
    c[at.START_X] = x * cosine - y * sine + (scene.runout ? facts.runout[0] * runout : settings.runout);
    c[at.START_Y] = x * sine + y * cosine + facts.runout[1] * runout;
  }
  return { c, k: block.cells, p: block.pieces, q: block.levels, start: block.start, facts };
}

const LOWER = 2; // row of the best that any lower pressure reaches

/** Least fill of a driven chamber at a gas pressure: of row 0 by stall and gas in its port, of row 1 by the latter. */
function leastFill(content, facts, pressure, row) {
  if (row === LOWER) return Math.min(...facts.least[0].filter((_, i) => content.pressures[i] <= pressure));
  return between(content.pressures, facts.least[row], pressure);
}

/** Time, s, by which each injection is shortened in place of the column's mass, which the exported disc leaves out. */
export function lostTime(content, settings) {
  const { lost } = content.valves[settings.valve] ?? content.designs[settings.design];
  return settings.mass ? between(content.pressures, lost, settings.pressure) : 0;
}

function between(x, y, pressure) {
  let i = 1;
  while (i < x.length - 1 && pressure > x[i]) i++;
  const part = Math.min(Math.max((pressure - x[i - 1]) / (x[i] - x[i - 1]), 0), 1);
  return y[i - 1] + part * (y[i] - y[i - 1]);
}

/** Constants, tables and row of the controller under settings. */
function controllerOf(content, numbers, settings) {
  const { algorithm } = settings, { places } = content, scene = sceneSettings(content), byLaw = algorithm === "law_based";
  const { device } = content.designs[settings.design], { cells, pieces, levels } = numbers[device];
  const own = byLaw ? numbers[content.devices.length + settings.design] : content.controllers[algorithm];
  const c = Float64Array.from(own.constants), at = byLaw ? places.lawBased : places.target;
  const w = Float64Array.from(own.start), row = byLaw ? places.lawBasedRow : own.row;
  if (algorithm === "trial") {
    c[places.trialLimit] = settings.limit;
    return { arguments: [c], w, row };
  }
  c[at.LIMIT] = settings.limit;
  [c[at.AMPLITUDE_SQUARE], c[at.PHASE_SQUARE]] = [settings.noise ** 2, settings.phase_noise ** 2];
  if (settings.offset !== scene.offset)
    for (let i = 0; i < content.disc.chambers; i++) c[byLaw ? at.OFFSETS + i : at.DIRECTIONS + 3 * i + 2] = settings.offset;
  if (!byLaw) {
    c[at.GAIN] = settings.gain;
    c[at.PER_TIME] = settings.integral === null ? 0 : 1 / settings.integral;
    c[at.DERIVATIVE] = settings.derivative;
  } else if (settings.pressure !== scene.pressure) {
    c[places.disc.SUPPLY] += settings.pressure - scene.pressure;
    c[at.LEAST_FILL] = leastFill(content, content.devices[device], settings.pressure, 1);
  }
  return { arguments: byLaw ? [c, cells, pieces, levels] : [c], w, row };
}

/** A reading with noise, by + - * / and a root alone: a small phase turns it by a rational rotation. */
export function noisy(x, y, [amplitude, phase], settings) {
  const size = Math.sqrt(x * x + y * y), half = (phase * settings.phase_noise) / 2, square = half * half;
  const cosine = (1 - square) / (1 + square), sine = (2 * half) / (1 + square);
  const factor = size > 0 ? Math.abs(size + amplitude * settings.noise) / size : 1;
  return [factor * (x * cosine - y * sine), factor * (x * sine + y * cosine)];
}

/** Largest moment of a pair, kg m, with its liquid moved to one side, by rows of `leastFill`. */
function pairMoment(content, plant, settings, row) {
  const { c, k, p } = plant, total = c[content.places.disc.TOTAL];
  const least = Math.min(leastFill(content, plant.facts, settings.pressure, row), total / 2);
  return moment(c, k, p, total - least) - moment(c, k, p, least);
}

/** Vibration that is left with the best fills of all pairs, m, by rows of `leastFill`. */
function leftAtBest(content, plant, settings, row) {
  const at = content.places.disc, { c } = plant, most = pairMoment(content, plant, settings, row);
  const [ix, iy] = [c[at.INFLUENCE_X], c[at.INFLUENCE_Y]], square = ix * ix + iy * iy;
  let x = (c[at.START_X] * ix + c[at.START_Y] * iy) / square, y = (c[at.START_Y] * ix - c[at.START_X] * iy) / square;
  const pairs = content.disc.chambers / 2, parts = new Array(pairs).fill(0);
  // Each pair in turn takes what it can of the rest.
  for (let round = 0; round < 60; round++)
    for (let i = 0; i < pairs; i++) {
      const [dx, dy] = [c[at.DIRECTIONS + 2 * i], c[at.DIRECTIONS + 2 * i + 1]];
      const wanted = Math.min(Math.max(parts[i] - (x * dx + y * dy), -most), most), change = wanted - parts[i];
      parts[i] = wanted;
      x += change * dx;
      y += change * dy;
    }
  return Math.sqrt((x * x + y * y) * square);
}

/** One run. `noise(k)` gives two standard normal numbers for the k-th sample; `loads` are steps of the unbalance. */
export class Run {
  constructor(content, numbers, settings, { device = null, noise = () => [0, 0], loads = [], slack = 0 } = {}) {
    const number = content.designs[settings.design].device + (device === null ? 0 : 1 + device);
    Object.assign(this, { content, settings, noise, loads, slack, rules: content.rules });
    this.plant = discOf(content, numbers, settings, number);
    this.w = Float64Array.from(this.plant.start);
    this.controller = controllerOf(content, numbers, settings);
    this.shorter = lostTime(content, settings);
    this.inputs = letters(content).map((letter) => content.places.row[`open_time_${letter}`]);
    this.commands = letters(content).map((letter) => this.controller.row[`open_time_${letter}`]);
    this.fills = letters(content).map((letter) => content.places.row[`fill_ratio_${letter}`]);
    Object.assign(this, { time: 0, part: 0, samples: 0, done: 0, still: false, ended: "", settled: null });
    Object.assign(this, { since: Infinity, held: Infinity, heldSince: Infinity, above: 0, lost: 0, rises: 0 });
    Object.assign(this, { idle: 0, overshoots: 0, seen: [0, 0], operated: false, first: NaN, last: NaN, before: null });
    const size = this.amplitude0 = Math.hypot(this.plant.c[this.at("START_X")], this.plant.c[this.at("START_Y")]);
    this.floor = this.rules.noiseDeviations * Math.SQRT2 * settings.noise + this.rules.roundOff * size;
    this.limit = this.rules.required ?? settings.limit;
    this.trace = { time: [], x: [], y: [], fill: this.fills.map(() => []) };
    this.injections = [];
    this.deadline = this.rules.timeLimit;
    this.#pass(0);
    this.#note();
  }

  at(name) { return this.content.places.disc[name]; }
  get x() { return this.value("vibration_x"); }
  get y() { return this.value("vibration_y"); }
  get amplitude() { return Math.hypot(this.x, this.y); }
  leftAtBest(row) { return leftAtBest(this.content, this.plant, this.settings, row); }
  /** Moment of a pair with its liquid moved to one side, kg m. */
  largestMoment() { return pairMoment(this.content, this.plant, this.settings, 0); }
  /** Value of a variable of the disc, such as "fill_ratio_a". */
  value(name) { return this.w[this.content.places.row[name]]; }

  /** End of the run, with the cause that formulas give where it has not settled. */
  get outcome() {
    if (this.ended === "" || this.ended === "settled") return this.ended;
    if (this.leftAtBest(1) > this.limit) return this.leftAtBest(LOWER) > this.limit ? "capacity_exceeded" : "emptied";
    return this.leftAtBest(0) > this.limit ? "stalled" : this.ended;
  }

  isOpen(chamber) {
    const { first, each, VALVE } = this.content.places.pairs, half = this.content.disc.chambers / 2;
    return this.w[first + each * (chamber % half) + VALVE + Math.floor(chamber / half)] !== 0;
  }

  /** Let the controller act, then a time pass of at most `most`, s, up to the next sample. */
  advance(most = PART) {
    const { w, row, arguments: settings } = this.controller;
    const [x, y] = noisy(this.x, this.y, this.noise(this.samples), this.settings);
    w[row.vibration_x] = x;
    w[row.vibration_y] = y;
    CONTROLLERS[this.settings.algorithm](...settings, w, this.part);
    if (w[row.samples] > this.samples) this.#sample(x, y);
    this.part = Math.min(w[row.wait], most);
    this.#pass(this.part);
    this.time += this.part;
    this.#load();
    this.#note();
  }

  /** Take up the loads that are due. */
  #load() {
    if (this.done === this.loads.length || this.loads[this.done].time > this.time + INSTANT) return;
    const { row } = this.content.places, { x, y } = this.loads[this.done++];
    this.plant.c[this.at("START_X")] += x;
    this.plant.c[this.at("START_Y")] += y;
    this.w[row.vibration_x] += x;
    this.w[row.vibration_y] += y;
    this.deadline = this.time + this.rules.timeLimit;
    Object.assign(this, { ended: "", settled: null, since: Infinity, heldSince: Infinity, held: Infinity, lost: 0, rises: 0, first: NaN });
    this.#load();
  }

  /** Add a step of the unbalance, as vibration, now. */
  addLoad(x, y) {
    this.loads = [...this.loads.slice(0, this.done), { time: this.time, x, y }];
    this.#load();
    this.#note();
  }

  /** Advance the disc, unless the step before, with all valves shut, has changed no number of its pairs by more than `slack`. */
  #pass(time) {
    const { c, k, p, q } = this.plant, { w } = this.controller;
    let open = false;
    this.inputs.forEach((index, i) => {
      this.w[index] = time > 0 ? Math.max(w[this.commands[i]] - this.shorter, 0) : 0;
      open ||= this.w[index] > 0;
    });
    if (this.still && !open) return;
    const { first } = this.content.places.pairs, before = this.w.slice(first);
    disc(c, k, p, q, this.w, time);
    this.still = !open && time > 0 && before.every((value, i) => Math.abs(this.w[first + i] - value) <= this.slack * Math.abs(value));
  }

  #note() {
    const above = this.amplitude > this.limit;
    this.since = above ? Infinity : Math.min(this.since, this.time);
    this.trace.time.push(this.time);
    this.trace.x.push(this.x);
    this.trace.y.push(this.y);
    this.fills.forEach((index, i) => this.trace.fill[i].push(this.w[index]));
  }

  /** Judge the run at a sample, by the rules of the program's own loop. */
  #sample(x, y) {
    const { rules, controller } = this, seen = Math.hypot(x, y);
    const moved = this.before !== null && this.fills.some((index, i) => Math.abs(this.w[index] - this.before[i]) > 1e-12);
    if (seen > this.limit && x * this.seen[0] + y * this.seen[1] < 0) this.overshoots += 1;
    this.seen = [x, y];
    this.samples += 1;
    if (Number.isNaN(this.first)) this.first = seen;
    if (this.operated) {
      const higher = seen - this.last > this.floor;
      this.rises = higher ? this.rises + 1 : 0;
      this.idle = moved ? 0 : this.idle + 1;
    }
    this.last = seen;
    this.#hold();
    const most = rules.rises[this.settings.algorithm], rose = this.last - this.first > this.floor;
    const watched = Math.min(this.since, this.heldSince) <= this.deadline && this.settled === null;
    const more = watched ? rules.hold + rules.watch + 2 * rules.period : 0;
    if (this.settled !== null) this.ended ||= "settled";
    else if (this.rises > most || (this.rises === most && rose)) this.ended ||= "overshooting";
    else if (this.time >= this.deadline + more)
      this.ended ||= this.lost > 0 ? "hovering" : this.idle >= rules.idle ? "gas_time_too_short" : 2 * this.overshoots > this.samples ? "overshooting" : "time_limit";
    this.operated = false;
    this.commands.forEach((index, chamber) => {
      const duration = controller.w[index];
      if (duration > 0) this.injections.push({ time: this.time, chamber, duration });
      this.operated ||= duration > 0;
    });
    this.before = this.fills.map((index) => this.w[index]);
  }

  #hold() {
    const { rules } = this;
    if (this.settled !== null) return;
    if (this.heldSince === Infinity) {
      if (this.time - this.since >= rules.hold * (1 - 1e-9) && this.since <= this.deadline)
        Object.assign(this, { heldSince: this.since, held: this.time, above: 0 });
    } else if (this.amplitude > this.limit) {
      this.above += 1;
      if (this.above > rules.allowed) {
        Object.assign(this, { heldSince: Infinity, held: Infinity });
        this.lost += 1;
      }
    }
    if (this.time >= this.held + rules.watch * (1 - 1e-9)) this.settled = this.heldSince;
  }
}

export const letters = (content) => [..."abcdefghijklmnopqrstuvwxyz"].slice(0, content.disc.chambers);

const COARSE = 0.1; // s, longest step of a run of many
const LONGEST_PART = 5e-3; // s
const OUT_OF_REACH = 2; // vibration left at best over the limit beyond which a run need not be carried out

/** End of a device's run: whether and when it settles, and what stops it. */
export function outcomeOf(content, numbers, settings, device, noise) {
  const run = new Run(content, numbers, settings, { device, noise, slack: 1e-9 });
  const { c } = run.plant, at = content.places.disc, volume = (1 - c[content.places.largestFill]) * c[at.VOLUME] + c[at.DEAD];
  // Longer parts of a step than a host takes, stable with the gas line: they change no outcome and save most of the time.
  c[at.LONGEST] = Math.min(LONGEST_PART, c[at.LINE] === 0 ? LONGEST_PART : (content.rules.partOfTimeConstant * volume) / c[at.PASSING]);
  if (run.leftAtBest(1) > OUT_OF_REACH * run.limit) run.ended = "capacity_exceeded";
  while (!run.ended) run.advance(COARSE);
  return { device, ended: run.outcome, time: run.settled ?? Infinity };
}
