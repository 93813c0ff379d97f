// The page of two eccentric masses: its state, its clock, and what is drawn.
import { whenSeenAnew } from "./canvas.js";
import { digits, lengthText, valueText } from "./controls.js";
import { Sliders, make } from "./form.js";
import { MASS_CONTROLS, MASS_SPEEDS, MassRun, massAddress, massSettings, massState } from "./mass_model.js";
import { MassPicture } from "./mass_picture.js";
import { drawPolarPlot } from "./polar_plot.js";
import { drawTimePlot } from "./time_plot.js";

const get = (id) => document.getElementById(id);
const FRAME_MS = 25; // of a frame, at most, in which samples are computed
const LETTER_PX = 10, AXIS_PX = 76; // of the number of a stage, and beside the time axis

class MassPanel {
  constructor(content) {
    Object.assign(this, { content, scene: massSettings(content), playing: false, before: 0, clock: 0 });
    this.calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const ranges = Object.fromEntries(Object.entries(content.controls).map(([name, { range }]) => [name, range]));
    const controls = Object.fromEntries(Object.entries(MASS_CONTROLS).filter(([name]) => name in ranges));
    this.sliders = new Sliders(controls, ranges, { change: (name, value) => this.set({}, { [name]: value }), marks: () => this.scene });
    this.picture = new MassPicture(get("masses"));
    this.#controls();
    addEventListener("hashchange", () => {
      if (location.hash.slice(1) !== massAddress(this.state, content)) this.set(massState(location.hash, content));
    });
    this.set(massState(location.hash, content));
    whenSeenAnew(get("time"), () => this.draw());
    requestAnimationFrame((now) => this.frame(now));
  }

  /** Take up parts of the state, and settings; the run begins again. */
  set(changes, settings = {}) {
    this.state = { ...this.state, ...changes };
    this.state.settings = { ...this.state.settings, ...settings };
    this.#address();
    this.sliders.show(this.state.settings);
    for (const name of ["device", "seed", "speed"]) get(name).value = this.state[name];
    this.restart();
  }

  restart() {
    const { device, seed, settings } = this.state;
    this.run = new MassRun(this.content, settings, { device, seed });
    this.said = "";
    if (this.calm) this.until(() => false);
    else this.play(true);
  }

  play(playing) {
    Object.assign(this, { playing, goal: null, shown: null, clock: this.run.time });
    get("play").textContent = playing ? "Pause" : "Play";
    this.draw();
  }

  /** Run as fast as the browser computes, until a condition or the end. */
  until(goal) {
    this.play(true);
    this.goal = goal;
  }

  frame(now) {
    const { run } = this, stop = performance.now() + FRAME_MS;
    this.clock += (Math.min(100, now - this.before) / 1000) * this.state.speed;
    this.before = now;
    if (this.playing) {
      while ((this.goal || run.time < this.clock) && !this.#there() && performance.now() < stop) run.advance();
      this.clock = Math.min(this.clock, run.time + 0.1);
      if (this.#there()) this.play(false);
      else if (!this.calm) this.draw();
    }
    requestAnimationFrame((next) => this.frame(next));
  }

  #there() {
    return this.run.over || Boolean(this.goal?.());
  }

  draw() {
    const { run, content, shown } = this, { trace, settings } = run;
    if (shown === null) run.keep();
    const at = shown ?? trace.time.length - 1, time = trace.time[at], { limit } = settings;
    const until = ({ time: times, x, y }) => ({ time: times.slice(0, at + 1), x: x.slice(0, at + 1), y: y.slice(0, at + 1) });
    const view = { trace: until(trace), limit, reference: until(run.reference) };
    const stages = run.stages.filter(({ time: start }) => start <= time);
    drawTimePlot(get("time"), { ...view, injections: [], letters: [], marks: this.#marks(stages, time) });
    drawPolarPlot(get("polar"), view);
    const angles = trace.angles.map((each) => each[at]), c = run.plant.numbers.constants, { imbalance, phase } = content.controls;
    const [size, angle] = [c[imbalance.places[0]], c[phase.places[0]]];
    this.picture.show({ angles, moment: run.own.moment, unbalance: [size * Math.cos(angle), size * Math.sin(angle)] });
    const amplitude = Math.hypot(trace.x[at], trace.y[at]), slider = get("at");
    get("clock").textContent = `${time.toFixed(content.step < 0.01 && !this.playing ? 3 : 1)} s`;
    get("reading").textContent = lengthText(amplitude);
    [0, 1].forEach((i) => this.#drive(i, at));
    get("rate").textContent = `${digits((trace.speed[at] * 30) / Math.PI, 4)} rpm`;
    get("energy").textContent = `${digits(trace.energy[at])} J`;
    slider.max = trace.time.length - 1;
    slider.value = at;
    const stage = trace.stage[at], within = amplitude <= limit ? "within the limit" : "above the limit";
    slider.setAttribute("aria-valuetext", `${time.toFixed(1)} s, ${stage}, ${lengthText(amplitude)}`);
    this.#say(this.#sentence(stage, within), stages);
    get("masses").setAttribute("aria-label", `Masses at ${angles.map((each) => `${(((each * 180) / Math.PI) % 360).toFixed(0)}°`).join(" and ")}`);
  }

  /** Starts of the stages with their numbers, where there is room. */
  #marks(stages, time) {
    const span = Math.max(time, 8), letter = (LETTER_PX * span) / (get("time").clientWidth - AXIS_PX);
    const room = (start, i) => (stages[i + 1]?.time ?? Infinity) - start > letter;
    return stages.map(({ time: start }, i) => ({ time: start, tone: "muted", label: room(start, i) ? String(i + 1) : "" })).filter((_, i) => i > 0);
  }

  #drive(i, at) {
    const { trace } = this.run, torques = trace.torques[i], most = torques.reduce((peak, each) => Math.max(peak, Math.abs(each)), 1e-12);
    const minus = (text) => text.replace("-", "−");
    get(`torque-${i + 1}`).textContent = minus(`${digits(torques[at] * 1e3, 2)} mN m`);
    get(`bar-${i + 1}`).style.setProperty("--at", `${((100 * Math.abs(torques[at])) / most).toFixed(1)}%`);
    get(`voltage-${i + 1}`).textContent = minus(`${digits(trace.voltages[i][at], 2)} V`);
  }

  #sentence(stage, within) {
    const { run } = this, { settled } = run;
    if (!run.over || this.shown !== null) return ["", `${stage}, ${within}`];
    if (run.diverged) return ["bad", "Diverged: the vibration grows without bound."];
    const limit = valueText(MASS_CONTROLS.limit, run.settings.limit), cause = run.cause.replaceAll("_", " ");
    if (settled !== null) return ["good", `Settled after ${digits(settled)} s: it stays within ${limit}.`];
    if (run.left) return ["bad", `Not settled: balanced, then above ${limit} again.`];
    const reason = cause === "none" ? `the run ends during ${stage}` : `the strategy ended with: ${cause}`;
    return ["bad", `Not settled: ${lengthText(run.amplitude)} at the end, limit ${limit}; ${reason}.`];
  }

  #say([tone, text], stages) {
    const said = `${text} ${stages.length}`;
    if (said === this.said) return;
    this.said = said;
    Object.assign(get("state"), { textContent: text, className: tone });
    get("time").setAttribute("aria-label", `Vibration over time: ${text}`);
    get("stages").replaceChildren(...stages.map(({ name, time }) => make("li", {}, name, make("span", { textContent: `${time.toFixed(3)} s` }))));
  }

  #address() {
    const text = massAddress(this.state, this.content);
    history.replaceState(null, "", text ? `#${text}` : location.pathname + location.search);
  }

  #controls() {
    const on = (id, kind, act) => get(id).addEventListener(kind, act), { devices } = this.content;
    devices.forEach(({ settled }, i) => {
      const name = i ? `device ${i}` : "as stated";
      get("device").append(new Option(`${name}: ${settled === null ? "not settled" : `settled after ${digits(settled)} s`}`, i));
    });
    get("count").textContent = `${devices.slice(1).filter(({ settled }) => settled !== null).length} of ${devices.length - 1} drawn devices settle.`;
    for (const speed of MASS_SPEEDS) get("speed").append(new Option(speed === 1 ? "real time" : `${speed} ×`, speed));
    on("play", "click", () => (this.run.over ? this.restart() : this.play(!this.playing)));
    on("step", "click", () => {
      if (!this.run.over) this.run.advance();
      this.play(false);
    });
    on("next", "click", () => {
      const { length } = this.run.stages;
      this.until(() => this.run.stages.length > length);
    });
    on("end", "click", () => this.until(() => false));
    on("restart", "click", () => this.restart());
    on("reset", "click", () => this.set({ device: 0 }, this.scene));
    on("device", "change", () => this.set({ device: Number(get("device").value) }));
    on("seed", "change", () => get("seed").checkValidity() && this.set({ seed: Number(get("seed").value) }));
    on("speed", "change", () => {
      this.state.speed = Number(get("speed").value);
      this.#address();
    });
    on("at", "input", () => {
      const shown = get("at").valueAsNumber;
      this.play(false);
      this.shown = shown;
      this.draw();
    });
  }
}
window.panel = new MassPanel(JSON.parse(get("content").textContent));
