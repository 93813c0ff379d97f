// The section of drawn devices: fraction that settles, times, causes, a dot for each device, and the valves.
import { digits } from "./controls.js";
import { summary, verdict } from "./devices.js";
import { make } from "./form.js";

export const CAUSES = {
  capacity_exceeded: "the unbalance is beyond what the disc can correct",
  emptied: "a chamber is empty before the unbalance is cancelled; a lower pressure may help",
  stalled: "the gas pressure does not move enough liquid",
  hovering: "noise or overshoot takes it above the limit again and again",
  gas_time_too_short: "valve-open times are too short to move liquid",
  overshooting: "every correction overshoots",
  time_limit: "the time runs out",
  too_late: "it settles later than required",
};
const BLOCK = 16;
const get = (id) => document.getElementById(id);
const percent = (value) => `${(100 * value).toFixed(value > 0.995 || value < 0.005 ? 0 : 1).replace(/\.0$/, "")} %`;
const times = ({ half, most }) => {
  if (!Number.isFinite(half)) return "Fewer than half settle.";
  return `Half settle within ${digits(half)} s; ${Number.isFinite(most) ? `90 % within ${digits(most)} s` : "fewer than 90 % settle"}.`;
};

export class Many {
  /** `watch(device)` and `choose(valve)` are called for what a reader picks. */
  constructor(content, pool, { watch, choose }) {
    Object.assign(this, { content, pool, watch, choose, dots: [], valves: [] });
    this.root = get("dots");
    this.root.addEventListener("keydown", (event) => this.#move(event));
    const rows = get("valves"), own = content.valve ?? "valve that acts at once, as the scene has it";
    rows.append(make("p", { className: "need" }, make("span", { textContent: `${percent(content.rules.fraction)} required` })));
    [own, ...content.valves.map((each) => each.name)].forEach((name, i) => {
      const radio = make("input", { type: "radio", name: "valve", value: i - 1 });
      radio.addEventListener("change", () => choose(i - 1));
      const [text, word, bar] = [make("span"), make("b"), make("span", { className: "bar" })];
      rows.append(make("label", {}, radio, make("span", { textContent: name }), bar, text, word));
      this.valves.push({ radio, text, word, bar, outcomes: [] });
    });
  }

  /** Run the devices of a state, then block by block with each other valve. `program`: its fraction of them, or null. */
  run(state, suited, program) {
    const { settings, seed } = state, { count } = this.content.designs[settings.design], outcomes = [];
    this.pool.stop();
    this.#grid(count, state.device);
    this.#show([], count, program);
    this.valves.forEach((row, i) => {
      row.radio.checked = i - 1 === settings.valve;
      row.outcomes = row.radio.checked ? outcomes : [];
    });
    this.#compare(count);
    const all = Array.from({ length: count }, (_, device) => device);
    this.pool.run(settings, all, seed, (outcome) => {
      outcomes.push(outcome);
      this.#show(outcomes, count, program);
      this.#compare(count);
    });
    for (let from = 0; from < count; from += BLOCK)
      this.valves.forEach((row, i) => {
        if (row.radio.checked) return;
        this.pool.run(suited(i - 1), all.slice(from, from + BLOCK), seed, (outcome) => {
          row.outcomes.push(outcome);
          this.#compare(count);
        });
      });
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

  #show(outcomes, count, program) {
    const { rules } = this.content, result = summary(outcomes, rules.settlingTime), { low, high } = result;
    for (const { device, ended, time } of outcomes) {
      const dot = this.dots[device], text = ended === "settled" ? `settles in ${digits(time)} s` : CAUSES[ended];
      dot.className = ended === "settled" && time <= rules.settlingTime ? "ok" : "no";
      dot.title = `device ${device + 1}: ${text}`;
      dot.setAttribute("aria-label", dot.title);
    }
    const some = result.of > 0, all = result.of === count, need = `${percent(rules.fraction)} are required`;
    get("share").textContent = some ? percent(result.count / result.of) : "–";
    get("share-text").textContent = some
      ? `settle: ${result.count} of ${result.of}${all ? "" : " so far"}, 95 % bounds ${percent(low)} to ${percent(high)}; ${need}${all ? `: ${verdict(result, rules.fraction)}` : ""}`
      : "running …";
    fill(get("bar"), result, rules.fraction);
    get("times").textContent = some ? times(result) : " ";
    const causes = result.causes.map(([cause, number]) => make("li", { textContent: `${number} × ${CAUSES[cause]}` }));
    get("causes").replaceChildren(...causes);
    get("check").textContent = all && program ? `Check: the full program finds ${program.count} of ${program.of} with the scene's settings (page: ${result.count}).` : "";
  }

  /** Compare the valves on the same devices: the first that have run with all of them, in whole blocks. */
  #compare(count) {
    const whole = (end) => this.valves.every(({ outcomes }) => outcomes.filter(({ device }) => device < end).length === end);
    let first = 0;
    while (first < count && whole(Math.min(first + BLOCK, count))) first = Math.min(first + BLOCK, count);
    const { settlingTime, fraction } = this.content.rules;
    for (const { outcomes, text, word, bar } of this.valves) {
      const result = summary(outcomes.filter(({ device }) => device < first), settlingTime);
      const median = Number.isFinite(result.half) ? `; median ${digits(result.half)} s` : "";
      text.textContent = first ? `${result.count} of ${first} settle${median}` : "…";
      word.textContent = first ? verdict(result, fraction) : "";
      word.classList.toggle("good", word.textContent === "met");
      fill(bar, result, fraction);
    }
  }
}

function fill(bar, { count, of, low, high }, need) {
  if (!bar.firstChild) bar.append(make("b"), make("i"), make("u"));
  const at = of ? count / of : 0;
  for (const [name, value] of [["at", at], ["low", of ? low : 0], ["high", of ? high : 0], ["need", need]]) bar.style.setProperty(`--${name}`, percent(value).replace(" ", ""));
  bar.title = of ? `${percent(at)}, 95 % bounds ${percent(low)} to ${percent(high)}` : "";
  if (bar.id) bar.setAttribute("aria-label", bar.title);
}
