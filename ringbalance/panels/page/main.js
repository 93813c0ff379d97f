// The page: its state, its clock, and what is drawn.
import { read, written } from "./address.js";
import { CONTROLS, digits, lengthText, sceneBlocks, valueText } from "./controls.js";
import { DevicePool, noiseOf, serve } from "./devices.js";
import { DiscPicture } from "./disc_picture.js";
import { Form, make } from "./form.js";
import { CAUSES, Many } from "./many.js";
import { PART, Run, letters, lostTime, sceneSettings } from "./model.js";
import { whenSeenAnew } from "./canvas.js";
import { normalPairs, unpack } from "./numbers.js";
import { drawPolarPlot } from "./polar_plot.js";
import { drawTimePlot } from "./time_plot.js";

const QUIET_S = 5; // s that a run goes on after it has held its limit
const MOST_STEPS = 2000; // in a frame
const REFERENCE_S = 60;
const TERMS = { "tube inertia": "the inertia of the liquid in the tube" };
const LOAD = 0.4; // vibration of a load over that of the unbalance
const get = (id) => document.getElementById(id);

class Panel {
  constructor(content, numbers, source) {
    Object.assign(this, { content, numbers, scene: sceneSettings(content), playing: false, before: 0 });
    this.state = read(location.hash, content, this.scene);
    this.calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.form = new Form(content, { change: (name, value) => this.set({ [name]: value }), marks: () => this.marks() });
    this.many = new Many(content, new DevicePool(source, content), {
      watch: (device) => this.set({}, { device }),
      choose: (valve) => this.set({ valve, ...this.suitedTo(valve) }),
    });
    this.picture = new DiscPicture(get("disc"), content.disc);
    this.#buttons();
    addEventListener("hashchange", () => {
      if (location.hash.slice(1) !== written(this.state, this.scene)) this.set({}, read(location.hash, content, this.scene));
    });
    whenSeenAnew(get("time"), () => this.draw());
    this.set({});
    requestAnimationFrame((now) => this.frame(now));
  }

  /** Settings that suit a valve: for the scene's own the scene's. */
  suitedTo(valve) {
    const { gain, integral, offset } = this.content.valves[valve]?.settings ?? this.scene;
    return { gain, integral, offset };
  }

  /** Marked values: the scene's, with those that suit the valve in use. */
  marks() {
    return { ...this.scene, ...this.suitedTo(this.state.settings.valve) };
  }

  /** Take up settings, and other parts of the state; the run begins again. */
  set(settings, others = {}) {
    Object.assign(this.state, others);
    this.state.settings = { ...this.state.settings, ...settings };
    const { content, state } = this, { design } = state.settings, changed = written(state, this.scene);
    history.replaceState(null, "", changed ? `#${changed}` : location.pathname + location.search);
    const run = new Run(content, this.numbers, state.settings, { noise: normalPairs(state.seed) });
    this.reference = null;
    const changedSettings = JSON.stringify(state.settings) !== JSON.stringify({ ...this.scene, design });
    if (changedSettings || state.device !== null) this.reference = this.#reference(design);
    this.form.show(state.settings, `A pair corrects up to ${digits(run.largestMoment() * 1e6)} g mm; the liquid leaves at ${digits(content.designs[design].velocity)} m/s.`);
    const which = state.device === null ? "of the device as the scene states it" : `of drawn device ${state.device + 1}`;
    get("which").textContent = this.reference ? `${which}; grey: the scene's settings` : which;
    for (const name of ["speed", "seed"]) get(name).value = state[name];
    get("block").textContent = sceneBlocks(content, state.settings, this.scene);
    get("facts").textContent = this.#facts();
    get("load").textContent = `a load of ${lengthText(LOAD * state.settings.amplitude)} now`;
    for (const button of document.querySelectorAll("[data-try^=gain]")) button.disabled = state.settings.algorithm !== "target_vector";
    const many = JSON.stringify([state.settings, state.seed]);
    if (many === this.manyOf) this.many.mark(state.device);
    else {
      clearTimeout(this.later);
      const suited = (valve) => ({ ...state.settings, valve, ...this.suitedTo(valve) });
      this.later = setTimeout(() => this.many.run(state, suited, changedSettings ? null : content.designs[design].program), 120);
    }
    this.manyOf = many;
    this.restart();
  }

  restart() {
    const { device, seed, settings, loads } = this.state;
    const noise = device === null ? normalPairs(seed) : noiseOf(seed, device);
    this.run = new Run(this.content, this.numbers, settings, { device, noise, loads });
    this.said = "";
    if (this.calm) this.toEnd();
    else this.play(true);
    this.draw();
  }

  play(playing) {
    this.playing = playing;
    get("play").textContent = playing ? "Pause" : "Play";
  }

  toEnd() {
    while (!this.#over()) this.run.advance(PART);
    this.play(false);
    this.draw();
  }

  #over() {
    const { run } = this;
    return run.time > 3600 || (run.done === run.loads.length && (run.ended !== "" || run.time > run.held + QUIET_S));
  }

  frame(now) {
    const until = this.run.time + (Math.min(100, now - this.before) / 1000) * this.state.speed;
    this.before = now;
    if (this.playing) {
      for (let i = 0; i < MOST_STEPS && this.run.time < until && !this.#over(); i++) this.run.advance(PART);
      if (this.#over()) this.play(false);
      this.draw();
    }
    requestAnimationFrame((next) => this.frame(next));
  }

  /** Trace under the scene's settings, for comparison; kept, as it never changes. */
  #reference(design) {
    this.references ??= new Map();
    if (!this.references.has(design)) {
      const run = new Run(this.content, this.numbers, { ...this.scene, design }, { noise: normalPairs(1) });
      while (run.time < REFERENCE_S && run.time <= run.held + QUIET_S) run.advance(PART);
      this.references.set(design, run.trace);
    }
    return this.references.get(design);
  }

  draw() {
    const { run, content, reference } = this, view = { ...run, trace: run.trace, limit: run.limit, reference };
    const marks = run.loads.slice(0, run.done).map(({ time }) => ({ time, label: "load" }));
    drawTimePlot(get("time"), { ...view, letters: letters(content), marks });
    drawPolarPlot(get("polar"), view);
    const at = content.places.disc, { c } = run.plant, [ix, iy] = [c[at.INFLUENCE_X], c[at.INFLUENCE_Y]];
    const [x, y] = [c[at.START_X], c[at.START_Y]], square = ix * ix + iy * iy;
    this.picture.show({
      fills: letters(content).map((letter) => run.value(`fill_ratio_${letter}`)),
      pressures: letters(content).map((letter) => run.value(`gas_pressure_${letter}`) - content.disc.ambient),
      open: letters(content).map((_, i) => run.isOpen(i)),
      unbalance: [(x * ix + y * iy) / square, (y * ix - x * iy) / square],
      correction: [run.value("moment_x"), run.value("moment_y")],
      highest: run.settings.pressure,
    });
    get("clock").textContent = `${run.time.toFixed(1)} s`;
    get("reading").textContent = `${digits(run.amplitude * 1e6, 3)} µm`;
    const [code, text] = this.#sentence();
    if (code === this.said) return;
    this.said = code;
    get("state").textContent = text;
    get("state").className = { above: "", within: "" }[code] ?? (code.startsWith("held") ? "good" : "bad");
    get("time").setAttribute("aria-label", `Vibration over time: ${text}`);
    get("disc").setAttribute("aria-label", `Liquid in the chambers: ${letters(content).map((letter) => `${letter.toUpperCase()} ${(100 * run.value(`fill_ratio_${letter}`)).toFixed(0)} %`).join(", ")}`);
  }

  #sentence() {
    const { run } = this, ended = run.outcome, load = run.done ? run.loads[run.done - 1].time : 0;
    if (ended && ended !== "settled") {
      const late = run.time >= run.deadline ? ` in ${digits(run.rules.timeLimit)} s` : "", after = run.done ? " after the load" : "";
      const advice = ended === "overshooting" && run.settings.algorithm === "target_vector" ? "; lower the gain" : "";
      return [ended, `Not settled${late}${after}: ${CAUSES[ended]}${advice} (${digits(run.amplitude * 1e6)} µm at the end, limit ${valueText(CONTROLS.limit, run.limit)}).`];
    }
    const since = Math.min(run.heldSince, run.settled ?? Infinity), passed = `${digits(since - load)} s`;
    const within = `it stays within ${valueText(CONTROLS.limit, run.limit)}.`;
    if (since < Infinity) return [`held ${load}`, run.done ? `Back within ${passed} after the load: ${within}` : `Settled after ${passed}: ${within}`];
    if (run.amplitude <= run.limit) return ["within", "Within the limit."];
    return ["above", "Above the limit: the valves correct."];
  }

  #facts() {
    const time = lostTime(this.content, this.state.settings) * 1e3, terms = this.content.leftOut.map((term) => TERMS[term] ?? `the ${term}`).join(" and ");
    if (!terms) return "";
    return `This page simplifies: ${time > 0 ? `in place of ${terms} it shortens each injection by ${digits(time)} ms.` : `it leaves out ${terms}.`}`;
  }

  #buttons() {
    const on = (id, act) => get(id).addEventListener("click", act);
    on("play", () => (this.#over() ? this.restart() : this.play(!this.playing)));
    on("step", () => {
      const { samples } = this.run;
      this.play(false);
      do this.run.advance(PART);
      while (this.run.samples === samples && !this.run.ended);
      this.draw();
    });
    on("end", () => this.toEnd());
    on("restart", () => this.restart());
    on("reset", () => this.set(this.scene, { device: null, loads: [] }));
    on("load", () => {
      const { amplitude, phase } = this.state.settings, angle = phase + 2;
      this.run.addLoad(LOAD * amplitude * Math.cos(angle), LOAD * amplitude * Math.sin(angle));
      this.state.loads = this.run.loads;
      history.replaceState(null, "", `#${written(this.state, this.scene)}`);
      if (this.calm) this.toEnd();
      else this.play(true);
    });
    for (const button of document.querySelectorAll("[data-try]"))
      button.addEventListener("click", () => {
        const [name, factor] = button.dataset.try.split(":");
        if (name === "algorithm") return this.set({ algorithm: factor });
        const [low, high] = this.content.ranges[name], { si } = CONTROLS[name];
        const value = Number(digits((this.state.settings[name] * Number(factor)) / si, 4)) * si;
        this.set({ [name]: Math.min(Math.max(value, low), high) });
      });
    get("speed").addEventListener("change", () => {
      this.state.speed = Number(get("speed").value);
      history.replaceState(null, "", `#${written(this.state, this.scene)}`);
    });
    get("seed").addEventListener("change", () => get("seed").checkValidity() && this.set({}, { seed: Number(get("seed").value) }));
    on("copy-link", () => this.#copy(location.href, "Link copied"));
    on("copy-block", () => this.#copy(get("block").textContent, "Settings copied"));
    on("save", () => this.#save());
  }

  async #copy(text, said) {
    try {
      await navigator.clipboard.writeText(text);
      get("copied").textContent = said;
    } catch {
      get("copied").textContent = "This browser does not let a page copy: take it from the field below or the address.";
    }
  }

  #save() {
    const { trace } = this.run, names = letters(this.content);
    const head = ["time_s", "vibration_x_m", "vibration_y_m", ...names.map((letter) => `fill_ratio_${letter}`)];
    const rows = trace.time.map((time, i) => [time, trace.x[i], trace.y[i], ...trace.fill.map((fill) => fill[i])].join(","));
    const file = new Blob([[head.join(","), ...rows, ""].join("\n")], { type: "text/csv" });
    const link = make("a", { href: URL.createObjectURL(file), download: "trace.csv" });
    link.click();
    URL.revokeObjectURL(link.href);
  }
}

/** Begin: in a worker to run devices, in a page to show them. */
export async function begin() {
  if (typeof document === "undefined") return serve(self);
  const content = JSON.parse(get("content").textContent);
  window.panel = new Panel(content, await unpack(content.numbers, content.lengths), get("program").textContent);
}
begin();
