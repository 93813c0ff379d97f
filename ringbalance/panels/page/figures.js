// Values of figures under a pointer and by arrow keys: a row of numbers for each point, one reading for all figures.

/**
 * @typedef {(number|null)[]} Position  of a row in a picture, pt from its upper left corner; null: not drawn
 * @typedef {{box: number[], at: Position[]}} Frame  left, top, width and height of axes, pt; position of each row
 * @typedef {{name: string, frames: Frame[]}} Figure
 * @typedef {{heads: string[][], rows: string[][], start: number, along: boolean, figures: Figure[]}} Content
 *     `heads`: name and unit of each column; `along`: rows lie along the x axis, and a pointer chooses by x alone
 */

const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** Part of a distance across the direction of a key that counts like one along it. */
const ACROSS = 8;

const drawn = ([x, y], along) => x !== null && (along || y !== null);

/** Row nearest to a point of the picture; -1 where none is drawn. */
export function nearest(at, x, y, along) {
  let best = -1, least = Infinity;
  at.forEach((position, row) => {
    const distance = Math.hypot(position[0] - x, along ? 0 : position[1] - y);
    if (drawn(position, along) && distance < least) [best, least] = [row, distance];
  });
  return best;
}

/** Row to which a key leads from another: the nearest in its direction; at the end, and for other keys, the same. */
export function next(at, row, key, along) {
  const rows = [...at.keys()].filter((other) => drawn(at[other], along));
  const order = (a, b) => at[a][0] - at[b][0] || (along ? 0 : at[b][1] - at[a][1]) || a - b;
  if (key === "Home") return rows.sort(order)[0];
  if (key === "End") return rows.sort(order).at(-1);
  const step = STEPS[key];
  if (!step || (along && step[1])) return row;
  const [[dx, dy], [x, y]] = [step, at[row]];
  let best = row, least = Infinity;
  for (const other of rows) {
    const [right, down] = [at[other][0] - x, along ? 0 : at[other][1] - y];
    const ahead = dx * right + dy * down, distance = ahead + ACROSS * Math.abs(dx * down + dy * right);
    // A tenth of a point is what positions are rounded to.
    if (ahead > 0.15 && distance < least) [best, least] = [other, distance];
  }
  return best;
}

/** Pairs of a name and a value with its unit; a value that is not known is a dash. */
export function reading({ heads, rows }, row) {
  return heads.map(([name, unit], column) => {
    const value = rows[row][column];
    return [name, value === "" ? "–" : unit ? `${value}\u202f${unit}` : value];
  });
}

/** Lines and rings, as attributes of SVG elements, that mark a row in a figure. */
export function marks({ frames }, row, along) {
  return frames.flatMap(({ box: [left, top, width, height], at }) => {
    const [x, y] = at[row];
    if (!drawn([x, y], along)) return [];
    const elements = [["line", { x1: x, x2: x, y1: top, y2: top + height }]];
    if (!along) elements.push(["line", { x1: left, x2: left + width, y1: y, y2: y }]);
    if (y !== null) elements.push(["circle", { cx: x, cy: y, r: 4 }]);
    return elements;
  });
}

/** Frame of a figure that a point of its picture lies in, or the first. */
export function frameAt({ frames }, x, y) {
  const inside = ({ box: [left, top, width, height] }) => x >= left && x <= left + width && y >= top && y <= top + height;
  return frames.find(inside) ?? frames[0];
}

/** Join a page with its content: pointers and keys move one row through all its figures. */
export function start(document, /** @type {Content} */ content) {
  const { figures, along } = content, list = document.querySelector("dl");
  const layers = figures.map(({ name }) => {
    const picture = document.getElementById(name).querySelector("svg");
    return picture.appendChild(document.createElementNS(picture.namespaceURI, "g"));
  });
  let current = -1;

  function show(row) {
    if (row < 0 || row === current) return;
    current = row;
    list.replaceChildren(...reading(content, row).flatMap((texts) => texts.map((text, i) => {
      const element = document.createElement(i ? "dd" : "dt");
      element.textContent = text;
      return element;
    })));
    figures.forEach((figure, i) => layers[i].replaceChildren(...marks(figure, row, along).map(([tag, attributes]) => {
      const element = document.createElementNS(layers[i].namespaceURI, tag);
      for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
      return element;
    })));
  }

  figures.forEach((figure, i) => {
    const picture = layers[i].ownerSVGElement, frame = document.getElementById(figure.name);
    const point = ({ clientX, clientY }) => {
      const { left, top, width } = picture.getBoundingClientRect(), scale = picture.viewBox.baseVal.width / width;
      const [x, y] = [(clientX - left) * scale, (clientY - top) * scale];
      show(nearest(frameAt(figure, x, y).at, x, y, along));
    };
    picture.addEventListener("pointermove", point);
    picture.addEventListener("pointerdown", point);
    frame.addEventListener("keydown", (event) => {
      if (!(event.key in STEPS) && event.key !== "Home" && event.key !== "End") return;
      event.preventDefault();
      show(next(figure.frames[0].at, current, event.key, along));
    });
  });
  show(content.start);
}
