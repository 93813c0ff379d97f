// The page that replays runs: its state, its clock, and what is drawn.
import { whenSeenAnew } from "./canvas.js";
import { digits, lengthText } from "./controls.js";
import { MassPicture } from "./mass_picture.js";
import { drawPolarPlot } from "./polar_plot.js";
import { REPLAY_SPEEDS, instantAt, profileAt, replayAddress, replayState, stageMarks, stateAt, unpackRuns } from "./replay.js";
import { drawTimePlot } from "./time_plot.js";

const get = (id) => document.getElementById(id);
const ADDRESS_MS = 500; // least time between changes of the address
const LETTER_PX = 7.5, AXIS_PX = 76; // of the name of a stage, and beside the time axis

class Replay {
  constructor(content, runs) {
    // The last run is that with locked masses.
    Object.assign(this, { content, runs, locked: runs.at(-1), playing: false, before: 0, said: "", addressed: 0 });
    this.state = replayState(location.hash, runs);
    this.picture = new MassPicture(get("masses"));
    this.#controls();
    addEventListener("hashchange", () => {
      if (location.hash.slice(1) !== replayAddress(this.state)) this.set(replayState(location.hash, runs));
    });
    whenSeenAnew(get("time"), () => this.draw());
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.play(!calm && !location.hash);
    this.set(calm && !location.hash ? { time: this.run.end } : {});
    requestAnimationFrame((now) => this.frame(now));
  }

  get run() {
    return this.runs[this.state.device];
  }

  set(changes) {
    Object.assign(this.state, changes);
    this.state.time = Math.min(Math.max(this.state.time, 0), this.run.end);
    if (this.state.time >= this.run.end) this.play(false);
    get("device").value = this.state.device;
    get("speed").value = this.state.speed;
    get("status").textContent = this.run.status;
    this.draw();
    this.#address();
  }

  play(playing) {
    this.playing = playing;
    get("play").textContent = playing ? "Pause" : "Play";
    if (!playing) this.#address(true);
  }

  frame(now) {
    const passed = Math.min(100, now - this.before) / 1000;
    this.before = now;
    if (this.playing) this.set({ time: this.state.time + passed * this.state.speed });
    requestAnimationFrame((next) => this.frame(next));
  }

  draw() {
    const { run, content, locked } = this, { time } = this.state, now = stateAt(run, time);
    const trace = traceUntil(run, time, now), view = { trace, limit: content.limit, reference: traceUntil(locked, time, stateAt(locked, time)) };
    const stages = stageMarks(run, time), letter = (LETTER_PX * Math.max(time, 8)) / (get("time").clientWidth - AXIS_PX);
    const room = (start, i) => Math.min(stages[i + 1]?.time ?? Infinity, Math.max(time, 8)) - start;
    const marks = stages.map(({ time: start, label }, i) => ({ time: start, tone: "muted", label: room(start, i) < letter * label.length ? "" : label }));
    drawTimePlot(get("time"), { ...view, injections: [], letters: [], marks });
    drawPolarPlot(get("polar"), view);
    this.picture.show({ ...now, moment: run.moment, unbalance: run.unbalance });
    const amplitude = Math.hypot(now.x, now.y), slider = get("at");
    get("clock").textContent = `${time.toFixed(1)} s`;
    get("reading").textContent = lengthText(amplitude);
    get("rate").textContent = `${digits((profileAt(content.profile, time) * 30) / Math.PI, 4)} rpm`;
    now.torques.forEach((torque, i) => {
      get(`torque-${i + 1}`).textContent = `${digits(torque * 1e3, 2).replace("-", "−")} mN m`;
      get(`bar-${i + 1}`).style.setProperty("--at", `${((100 * Math.abs(torque)) / run.torque).toFixed(1)}%`);
    });
    slider.max = run.time.length - 1;
    slider.value = instantAt(run, time);
    slider.setAttribute("aria-valuetext", `${time.toFixed(1)} s, ${now.stage}, ${lengthText(amplitude)}`);
    const within = amplitude <= content.limit ? "within the limit" : "above the limit";
    this.#say(`${now.stage}, ${within}`, `Vibration over time: device ${this.state.device}, ${now.stage}, ${within}`);
    get("masses").setAttribute("aria-label", `Masses at ${now.angles.map((angle) => `${(((angle * 180) / Math.PI) % 360).toFixed(0)}°`).join(" and ")}`);
  }

  #say(text, label) {
    if (text === this.said) return;
    this.said = text;
    get("state").textContent = text;
    get("time").setAttribute("aria-label", label);
  }

  /** Browsers refuse an address that changes with each frame. */
  #address(now = false) {
    if (!now && performance.now() - this.addressed < ADDRESS_MS) return;
    this.addressed = performance.now();
    const text = replayAddress(this.state);
    history.replaceState(null, "", text ? `#${text}` : location.pathname + location.search);
  }

  #controls() {
    const on = (id, kind, act) => get(id).addEventListener(kind, act);
    this.runs.slice(0, -1).forEach(({ settled }, i) => {
      const name = i ? `device ${i}` : "as the scene states it";
      get("device").append(new Option(`${name}: ${settled === null ? "not settled" : `settled after ${digits(settled)} s`}`, i));
    });
    for (const speed of REPLAY_SPEEDS) get("speed").append(new Option(`× ${speed}`, speed));
    on("play", "click", () => {
      if (!this.playing && this.state.time >= this.run.end) this.set({ time: 0 });
      this.play(!this.playing);
    });
    on("restart", "click", () => this.set({ time: 0 }));
    on("end", "click", () => this.set({ time: this.run.end }));
    on("device", "change", () => this.set({ device: Number(get("device").value), time: 0 }));
    on("device", "change", () => this.play(true));
    on("speed", "change", () => this.set({ speed: Number(get("speed").value) }));
    on("at", "input", () => {
      this.play(false);
      this.set({ time: this.run.time[get("at").valueAsNumber] });
    });
  }
}

/** Part of a run until a time, with the state at that time. */
function traceUntil(run, time, { x, y }) {
  const count = instantAt(run, time) + 1, part = (values, last) => [...values.subarray(0, count), last];
  return { time: part(run.time, Math.min(time, run.end)), x: part(run.x, x), y: part(run.y, y) };
}

async function begin() {
  const content = JSON.parse(get("content").textContent), runs = await unpackRuns(content);
  const settled = runs.slice(1, -1).filter((run) => run.settled !== null).length;
  get("count").textContent = `${settled} of ${runs.length - 2} drawn devices settle.`;
  window.panel = new Replay(content, runs);
}
begin();
