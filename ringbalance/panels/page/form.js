// The form of settings: a slider with unit, range and the scene's mark for every control.
import { CONTROLS, STEPS, shownUnit, stepOf, valueAt, valueText } from "./controls.js";

/** Element with properties and children. */
export function make(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

export class Form {
  /** `change(name, value)` is called for each value that a reader sets; `marks()` gives the values that are marked. */
  constructor(content, { change, marks }) {
    Object.assign(this, { content, change, marks, sliders: {} });
    const get = (id) => document.getElementById(id);
    for (const [name, control] of Object.entries(CONTROLS))
      get(control.further ? "further" : `controls-${control.group}`).append(this.#slider(name, control));
    for (const name of ["algorithm", "design", "mass"]) this[name] = get(name);
    this.algorithm.addEventListener("change", () => change("algorithm", this.algorithm.value));
    this.mass.addEventListener("change", () => change("mass", this.mass.checked));
    this.design.addEventListener("input", () => change("design", Number(this.design.value)));
    this.design.max = content.designs.length - 1;
    get("design-label").textContent = content.axes.join(", ");
    get("designs").hidden = content.designs.length < 2;
    this.designText = get("design-text");
    this.designFacts = get("design-facts");
  }

  #slider(name, { label, unit, note }) {
    const id = `control-${name}`, range = this.content.ranges[name];
    const slider = make("input", { type: "range", id, min: 0, max: STEPS, step: 1 });
    const output = make("output", { htmlFor: id }), mark = make("i");
    const undo = make("button", { type: "button", className: "undo", textContent: "↺", title: "back to the marked value" });
    undo.setAttribute("aria-label", `${label}: back to the marked value`);
    const words = make("label", { htmlFor: id, textContent: label, title: [note, `in ${shownUnit(unit)}`].filter(Boolean).join(", ") });
    const node = make("div", { className: "control" }, words, output, undo, make("span", { className: "track" }, slider, mark));
    const back = () => this.change(name, this.marks()[name]);
    slider.addEventListener("input", () => this.change(name, valueAt(name, range, Number(slider.value))));
    slider.addEventListener("dblclick", back);
    undo.addEventListener("click", () => (back(), slider.focus()));
    this.sliders[name] = { node, slider, output, mark };
    return node;
  }

  /** Show settings. `facts`: text on the design in use. */
  show(settings, facts) {
    const marks = this.marks();
    for (const [name, { node, slider, output, mark }] of Object.entries(this.sliders)) {
      const range = this.content.ranges[name], text = valueText(name, settings[name]), step = stepOf(name, range, settings[name]);
      if (Math.abs(Number(slider.value) - step) >= 1) slider.value = step;
      slider.setAttribute("aria-valuetext", text);
      output.textContent = text;
      mark.style.setProperty("--mark", stepOf(name, range, marks[name]) / STEPS);
      mark.title = `marked: ${valueText(name, marks[name])}`;
      node.classList.toggle("changed", settings[name] !== marks[name]);
      node.hidden = Boolean(CONTROLS[name].of && !CONTROLS[name].of.includes(settings.algorithm));
    }
    this.algorithm.value = settings.algorithm;
    this.mass.checked = settings.mass;
    this.design.value = settings.design;
    this.designText.textContent = this.content.designs[settings.design].name;
    this.design.setAttribute("aria-valuetext", this.designText.textContent);
    this.designFacts.textContent = facts;
  }
}
