// The disc in its own frame, as SVG: liquid of each chamber to scale, tubes over their crest, valves and gas.

const NAMESPACE = "http://www.w3.org/2000/svg";
const SIZE = 200, EDGE = 20, GAP = 0.035;

/** Element of an SVG with attributes, appended to a parent. */
export function element(parent, name, attributes = {}, text = "") {
  const child = document.createElementNS(NAMESPACE, name);
  for (const [key, value] of Object.entries(attributes)) child.setAttribute(key, value);
  if (text) child.textContent = text;
  parent.append(child);
  return child;
}

/** Path of a part of a ring between two radii and two angles, counted with the rotation from the right. */
export function sector(inner, outer, from, to) {
  const at = (radius, angle) => `${(radius * Math.cos(angle)).toFixed(2)} ${(-radius * Math.sin(angle)).toFixed(2)}`;
  const large = to - from > Math.PI ? 1 : 0;
  return `M${at(outer, from)}A${outer} ${outer} 0 ${large} 0 ${at(outer, to)}L${at(inner, to)}A${inner} ${inner} 0 ${large} 1 ${at(inner, from)}Z`;
}

/** Radius of the free surface at a fill ratio, by the area of the ring. */
export function surfaceRadius(inner, outer, fill) {
  return Math.sqrt(outer * outer - fill * (outer * outer - inner * inner));
}

export class DiscPicture {
  constructor(svg, disc) {
    const chambers = disc.chambers, scale = (SIZE - EDGE) / disc.outer;
    Object.assign(this, { disc, outer: SIZE - EDGE, inner: disc.inner * scale });
    svg.setAttribute("viewBox", `${-SIZE} ${-SIZE} ${2 * SIZE} ${2 * SIZE}`);
    const half = Math.min(disc.angle, (2 * Math.PI) / chambers) / 2 - GAP;
    element(svg, "circle", { r: this.outer + 6, class: "rim" });
    this.chambers = Array.from({ length: chambers }, (_, i) => {
      const middle = (2 * Math.PI * i) / chambers, [from, to] = [middle - half, middle + half];
      const gas = element(svg, "path", { d: sector(this.inner, this.outer, from, to), class: "gas" });
      const liquid = element(svg, "path", { class: "liquid" });
      const [x, y] = [Math.cos(middle), -Math.sin(middle)];
      const valve = element(svg, "circle", { cx: (this.inner + 13) * x, cy: (this.inner + 13) * y, r: 6, class: "valve" });
      return { gas, liquid, valve, from, to };
    });
    const port = Math.min(disc.port * scale, this.outer);
    for (let i = 0; i < chambers / 2; i++) this.#tube(svg, i, half, port, disc.crest === null ? null : disc.crest * scale);
    this.chambers.forEach((chamber, i) => {
      const middle = (2 * Math.PI * i) / chambers, [x, y] = [(0.6 * this.inner + 0.4 * this.outer) * Math.cos(middle), (-(this.inner + this.outer) / 2) * Math.sin(middle)];
      element(svg, "text", { x, y: y + 2, class: "letter" }, String.fromCharCode(65 + i));
      chamber.pressure = element(svg, "text", { x, y: y + 18, class: "pressure" });
    });
    element(svg, "circle", { r: this.inner - 8, class: "shaft" });
    this.unbalance = element(svg, "path", { class: "unbalance" });
    this.correction = element(svg, "path", { class: "correction" });
  }

  /** Tube of a pair: from the outer wall of each chamber inwards to the crest, and round the shaft to the other. */
  #tube(svg, pair, half, port, crest) {
    const middle = (2 * Math.PI * pair) / this.disc.chambers, start = middle + half * 0.72;
    const end = middle + Math.PI - half * 0.72, level = (crest ?? this.inner) - 5 * pair;
    const at = (radius, angle) => `${(radius * Math.cos(angle)).toFixed(2)} ${(-radius * Math.sin(angle)).toFixed(2)}`;
    const large = end - start > Math.PI ? 1 : 0;
    const path = `M${at(port - 3, start)}L${at(level, start)}A${level} ${level} 0 ${large} 0 ${at(level, end)}L${at(port - 3, end)}`;
    element(svg, "path", { d: path, class: "tube" });
  }

  /** Show fills, gauge pressures of the gas, Pa, open valves, and unbalance and correction as vectors, kg m. */
  show({ fills, pressures, open, unbalance, correction, highest }) {
    this.chambers.forEach((chamber, i) => {
      const surface = surfaceRadius(this.inner, this.outer, fills[i]);
      chamber.liquid.setAttribute("d", sector(surface, this.outer, chamber.from, chamber.to));
      chamber.valve.classList.toggle("open", open[i]);
      chamber.gas.style.setProperty("--filled", Math.min(Math.max(pressures[i] / highest, 0), 1).toFixed(3));
      const text = pressures[i] > 0.01 * highest ? `${(pressures[i] / 1e6).toFixed(2)} MPa` : "";
      if (chamber.pressure.textContent !== text) chamber.pressure.textContent = text;
    });
    const longest = Math.max(Math.hypot(...unbalance), Math.hypot(...correction), 1e-30);
    for (const [arrow, vector] of [[this.unbalance, unbalance], [this.correction, correction]])
      arrow.setAttribute("d", arrowPath(vector, (this.inner - 14) / longest));
  }
}

/** Arrow from the centre. */
function arrowPath([x, y], scale) {
  const length = Math.hypot(x, y) * scale;
  if (length < 2) return "";
  const [ux, uy] = [(x * scale) / length, (-y * scale) / length], head = Math.min(9, length);
  const [bx, by] = [(length - head) * ux, (length - head) * uy];
  return `M0 0L${bx} ${by}M${length * ux} ${length * uy}L${bx - 0.55 * head * uy} ${by + 0.55 * head * ux}L${bx + 0.55 * head * uy} ${by - 0.55 * head * ux}Z`;
}
