// The form of settings: a slider with unit, range and the scene's mark for every control.
import { CONTROLS, STEPS, shownUnit, stepOf, valueAt, valueText } from "./controls.js";

/** Element with properties and children. */
export function make(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

/** Sliders with unit, range and mark, by name of their control. */
export class Sliders {
  /** `change(name, value)` is called for each value that a reader sets; `marks()` gives the values that are marked. */
  constructor(controls, ranges, { change, marks }) {
    Object.assign(this, { controls, ranges, change, marks, parts: {} });
    for (const [name, control] of Object.entries(controls))
      document.getElementById(control.further ? "further" : `controls-${control.group}`).append(this.#slider(name, control));
  }

  #slider(name, control) {
    const id = `control-${name}`, range = this.ranges[name], { label, unit, note } = control;
    const slider = make("input", { type: "range", id, min: 0, max: STEPS, step: 1 });
    const output = make("output", { htmlFor: id }), mark = make("i");
    const undo = make("button", { type: "button", className: "undo", textContent: "↺", title: "back to the marked value" });
    undo.setAttribute("aria-label", `${label}: back to the marked value`);
    const words = make("label", { htmlFor: id, textContent: label, title: [note, unit && `in ${shownUnit(unit)}`].filter(Boolean).join(", ") });
    const node = make("div", { className: "control" }, words, output, undo, make("span", { className: "track" }, slider, mark));
    const back = () => this.change(name, this.marks()[name]);
    slider.addEventListener("input", () => this.change(name, valueAt(control, range, Number(slider.value))));
    slider.addEventListener("dblclick", back);
    undo.addEventListener("click", () => (back(), slider.focus()));
    this.parts[name] = { node, slider, output, mark };
    return node;
  }

  show(settings) {
    const marks = this.marks();
    for (const [name, { node, slider, output, mark }] of Object.entries(this.parts)) {
      const control = this.controls[name], range = this.ranges[name];
      const text = valueText(control, settings[name]), step = stepOf(control, range, settings[name]);
      if (Math.abs(Number(slider.value) - step) >= 1) slider.value = step;
      slider.setAttribute("aria-valuetext", text);
      output.textContent = text;
      mark.style.setProperty("--mark", stepOf(control, range, marks[name]) / STEPS);
      mark.title = `marked: ${valueText(control, marks[name])}`;
      node.classList.toggle("changed", settings[name] !== marks[name]);
      node.hidden = Boolean(control.of && !control.of.includes(settings.algorithm));
    }
  }
}

/** The form of the ring's page. */
export class Form {
  constructor(content, { change, marks }) {
    this.content = content;
    this.sliders = new Sliders(CONTROLS, content.ranges, { change, marks });
    const get = (id) => document.getElementById(id);
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

  /** Show settings. `facts`: text on the design in use. */
  show(settings, facts) {
    this.sliders.show(settings);
    this.algorithm.value = settings.algorithm;
    this.mass.checked = settings.mass;
    this.design.value = settings.design;
    this.designText.textContent = this.content.designs[settings.design].name;
    this.design.setAttribute("aria-valuetext", this.designText.textContent);
    this.designFacts.textContent = facts;
  }
}
