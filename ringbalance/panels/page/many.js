// The section of drawn devices: fraction that settles, times, causes, a dot for each device, and the valves.
import { digits } from "./controls.js";
import { summary } from "./devices.js";
import { make } from "./form.js";

export const CAUSES = {
  capacity_exceeded: "the unbalance is beyond what the disc can correct",
  stalled: "the gas pressure does not move enough liquid",
  diverging: "the vibration grows: corrections overshoot",
  hovering: "noise or overshoot takes it above the limit again and again",
  gas_time_too_short: "valve-open times are too short to move liquid",
  overshooting: "every correction overshoots, until the time runs out",
  time_limit: "the time runs out",
  too_late: "it settles later than required",
};
const FIRST = 16;
const percent = (value) => `${(100 * value).toFixed(value > 0.995 || value < 0.005 ? 0 : 1).replace(/\.0$/, "")} %`;
const times = (part, time) => (Number.isFinite(time) ? `${part} within ${digits(time)} s` : `fewer than ${part} at all`);

export class Many {
  /** `watch(device)` and `choose(valve)` are called for what a reader picks. */
  constructor(content, pool, { watch, choose }) {
    Object.assign(this, { content, pool, watch, choose, dots: [], valves: [] });
    this.root = document.getElementById("dots");
    this.root.addEventListener("keydown", (event) => this.#move(event));
    const rows = document.getElementById("valves"), own = content.valve ?? "valve that acts at once, as the scene has it";
    [own, ...content.valves.map((each) => each.name)].forEach((name, i) => {
      const radio = make("input", { type: "radio", name: "valve", value: i - 1 });
      radio.addEventListener("change", () => choose(i - 1));
      const text = make("span"), bar = make("span", { className: "bar" });
      rows.append(make("label", {}, radio, make("span", { textContent: name }), bar, text));
      this.valves.push({ radio, text, bar, result: summary([], 0) });
    });
  }

  /** Run the devices of a state, then with each other valve a first part of them and the rest. */
  run(state, suited) {
    const { settings, seed } = state, { count } = this.content.designs[settings.design];
    this.pool.stop();
    this.#grid(count, state.device);
    this.#show([], count);
    const all = Array.from({ length: count }, (_, device) => device);
    this.pool.run(settings, all, seed, (outcomes) => {
      this.#show(outcomes, count);
      this.#row(settings.valve, outcomes);
    });
    const others = this.valves.map((_, i) => i - 1).filter((valve) => valve !== settings.valve), first = new Map();
    this.valves.forEach(({ radio }, i) => {
      radio.checked = i - 1 === settings.valve;
      this.#row(i - 1, []);
    });
    for (const valve of others)
      this.pool.run(suited(valve), all.slice(0, FIRST), seed, (outcomes) => {
        first.set(valve, outcomes);
        this.#row(valve, outcomes);
      });
    for (const valve of others)
      this.pool.run(suited(valve), all.slice(FIRST), seed, (more) => this.#row(valve, [...(first.get(valve) ?? []), ...more]));
  }

  #grid(count, watched) {
    if (this.dots.length !== count) {
      this.dots = Array.from({ length: count }, (_, device) => {
        const dot = make("button", { type: "button", tabIndex: device === 0 ? 0 : -1 });
        dot.addEventListener("click", () => this.watch(dot.getAttribute("aria-pressed") === "true" ? null : device));
        return dot;
      });
      this.root.replaceChildren(...this.dots);
    }
    this.dots.forEach((dot, device) => {
      dot.className = "";
      dot.setAttribute("aria-label", `device ${device + 1}`);
    });
    this.mark(watched);
  }

  /** Mark the device that is watched; null: none. */
  mark(watched) {
    this.dots.forEach((dot, device) => dot.setAttribute("aria-pressed", device === watched));
  }

  #move(event) {
    const step = { ArrowRight: 1, ArrowLeft: -1, ArrowDown: 16, ArrowUp: -16 }[event.key];
    const next = this.dots[this.dots.indexOf(document.activeElement) + step];
    if (!next) return;
    event.preventDefault();
    document.activeElement.tabIndex = -1;
    next.tabIndex = 0;
    next.focus();
  }

  #show(outcomes, count) {
    const { rules, designs } = this.content, result = summary(outcomes, rules.settlingTime);
    for (const { device, ended, time } of outcomes) {
      const dot = this.dots[device], text = ended === "settled" ? `settles in ${digits(time)} s` : CAUSES[ended];
      dot.className = ended === "settled" && time <= rules.settlingTime ? "ok" : "no";
      dot.title = `device ${device + 1}: ${text}`;
      dot.setAttribute("aria-label", dot.title);
    }
    const some = result.of > 0, { low, high } = result;
    document.getElementById("share").textContent = some ? percent(result.count / result.of) : "–";
    document.getElementById("share-text").textContent = some
      ? `settle: ${result.count} of ${result.of}${result.of < count ? " so far" : ""}, 95 % bounds ${percent(low)} to ${percent(high)}; ${percent(rules.fraction)} are required`
      : "running …";
    fill(document.getElementById("bar"), result, rules.fraction);
    document.getElementById("times").textContent = some ? `They settle: ${times("half", result.half)}, ${times("nine of ten", result.most)}.` : " ";
    const causes = result.causes.map(([cause, number]) => make("li", { textContent: `${number} × ${CAUSES[cause]}` }));
    document.getElementById("causes").replaceChildren(...causes);
  }

  #row(valve, outcomes) {
    const row = this.valves[valve + 1], result = (row.result = summary(outcomes, this.content.rules.settlingTime));
    row.text.textContent = result.of ? `${result.count} of ${result.of}, ${times("half", result.half)}` : "…";
    fill(row.bar, result, this.content.rules.fraction);
    // Of the valves that can be had, the one that serves most devices, and of equals the fastest.
    const sold = this.valves.slice(1), part = ({ count, of }) => (of ? count / of : 0);
    const ready = sold.every(({ result: other }) => other.of === this.dots.length);
    const best = [...sold].sort((a, b) => part(b.result) - part(a.result) || a.result.half - b.result.half)[0];
    sold.forEach((each) => each.text.classList.toggle("best", ready && each === best && part(best.result) > 0));
  }
}

function fill(bar, { count, of, low, high }, need) {
  if (!bar.firstChild) bar.append(make("b"), make("i"), make("u"));
  const at = of ? count / of : 0;
  for (const [name, value] of [["at", at], ["low", of ? low : 0], ["high", of ? high : 0], ["need", need]]) bar.style.setProperty(`--${name}`, percent(value).replace(" ", ""));
  bar.title = of ? `${percent(at)}, 95 % bounds ${percent(low)} to ${percent(high)}` : "";
  if (bar.id) bar.setAttribute("aria-label", bar.title);
}


