// Two masses on their track in the frame of the rotor, as SVG, with the unbalance and the moment of both masses.
import { element } from "./disc_picture.js";

const SIZE = 200, TRACK = 150, MASS = 15;
const NAMES = ["1", "2"];

/** Moments to scale, kg m: that of the unbalance, and that of both masses together. */
export function moments({ angles, moment, unbalance }) {
  const along = (part) => angles.reduce((sum, angle) => sum + moment * part(angle), 0);
  return { unbalance, masses: [along(Math.cos), along(Math.sin)] };
}

export class MassPicture {
  constructor(svg) {
    svg.setAttribute("viewBox", `${-SIZE} ${-SIZE} ${2 * SIZE} ${2 * SIZE}`);
    element(svg, "circle", { r: TRACK, class: "rim" });
    element(svg, "circle", { r: 9, class: "shaft" });
    this.arrows = ["unbalance", "correction"].map((name) => element(svg, "path", { class: name }));
    this.masses = NAMES.map((name) => {
      const group = element(svg, "g", { class: "mass" });
      element(group, "circle", { r: MASS });
      element(group, "text", { y: 6, class: "letter" }, name);
      return group;
    });
  }

  /** Show masses at their angles, rad, counted with the rotation from the right. */
  show(state) {
    const { unbalance, masses } = moments(state), most = Math.max(Math.hypot(...unbalance), 2 * state.moment);
    state.angles.forEach((angle, i) => {
      const [x, y] = [TRACK * Math.cos(angle), -TRACK * Math.sin(angle)];
      this.masses[i].setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)})`);
    });
    [unbalance, masses].forEach(([x, y], i) => this.arrows[i].setAttribute("d", arrow((x / most) * 120, (-y / most) * 120)));
  }
}

/** Path of an arrow from the centre; none without length. */
function arrow(x, y) {
  const length = Math.hypot(x, y);
  if (length < 2) return "";
  const [dx, dy] = [x / length, y / length], at = (along, across) => `${(along * dx - across * dy).toFixed(2)} ${(along * dy + across * dx).toFixed(2)}`;
  return `M${at(11, 0)}L${at(length, 0)}M${at(length, 0)}L${at(length - 10, 5)}L${at(length - 10, -5)}Z`;
}
