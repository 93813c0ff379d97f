// The form of settings: a slider with unit, range and the scene's mark for every control.
import { ALGORITHMS, CONTROLS, STEPS, shownUnit, stepOf, valueAt, valueText } from "./controls.js";

/** Element with properties and children. */
export function make(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

export class Form {
  /** `change(name, value)` is called for each value that a reader sets; `marks()` gives the values that are marked. */
  constructor(root, content, { change, marks }) {
    Object.assign(this, { content, change, marks, sliders: {} });
    const further = make("details", {}, make("summary", { textContent: "More" }));
    for (const group of ["Rotor", "Air", "Controller"]) {
      const field = make("fieldset", { className: "group" }, make("legend", { textContent: group }));
      if (group === "Controller") field.append(this.#algorithm());
      for (const [name, control] of Object.entries(CONTROLS))
        if (control.group === group) (control.further ? further : field).append(this.#slider(name, control));
      root.append(field);
    }
    this.mass = make("input", { type: "checkbox", id: "mass" });
    this.mass.addEventListener("change", () => change("mass", this.mass.checked));
    further.append(make("label", {}, this.mass, " injections shortened in place of the column's mass"));
    if (content.designs.length > 1) root.prepend(this.#designs());
    root.append(further);
  }

  #algorithm() {
    this.algorithm = make("select", { id: "algorithm" });
    for (const [value, textContent] of Object.entries(ALGORITHMS)) this.algorithm.append(make("option", { value, textContent }));
    this.algorithm.addEventListener("change", () => this.change("algorithm", this.algorithm.value));
    return make("div", { className: "choice" }, make("label", { htmlFor: "algorithm", textContent: "Algorithm" }), this.algorithm);
  }

  #designs() {
    const { designs, axes } = this.content;
    this.design = make("input", { type: "range", id: "design", min: 0, max: designs.length - 1, step: 1 });
    this.design.addEventListener("input", () => this.change("design", Number(this.design.value)));
    this.designText = make("output", { htmlFor: "design" });
    this.designFacts = make("p", { className: "note" });
    const label = make("label", { htmlFor: "design", textContent: `Design: ${axes.join(", ")}` });
    const track = make("span", { className: "track" }, this.design);
    return make("fieldset", { className: "group" }, make("legend", { textContent: "Design" }), make("div", { className: "control" }, label, this.designText, track), this.designFacts);
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
    if (!this.design) return;
    this.design.value = settings.design;
    this.designText.textContent = this.content.designs[settings.design].name;
    this.design.setAttribute("aria-valuetext", this.designText.textContent);
    this.designFacts.textContent = facts;
  }
}
