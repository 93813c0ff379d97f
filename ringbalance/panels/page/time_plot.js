// Vibration over time on a logarithmic axis, with the limit and the injections of each chamber below.
import { decades, evenStep, prepared } from "./canvas.js";
import { digits, lengthText } from "./controls.js";

const LEFT = 62, RIGHT = 14, TOP = 14, LANE = 15, AXIS = 26;
const LEAST_SPAN = 8;

/**
 * Draw a run. `view`: `trace` (time, s; x, y, m), `injections` (time, chamber, duration), `letters`, `limit`, and
 * optionally `reference`, another trace, and `marks`, times with a text.
 */
export function drawTimePlot(canvas, { trace, injections, letters, limit, reference, marks = [] }) {
  const { context, width, height, colour } = prepared(canvas);
  if (width <= LEFT + RIGHT) return;
  const span = Math.max(LEAST_SPAN, trace.time.at(-1) * 1.03), lanes = LANE * letters.length;
  const bottom = height - AXIS - lanes - 8;
  const most = Math.max(peak(trace), reference ? peak(reference) : 0, 2 * limit) * 1.4, least = limit / 40;
  const x = (time) => LEFT + (time / span) * (width - LEFT - RIGHT);
  const y = (amplitude) => bottom - (Math.log(Math.max(amplitude, least) / least) / Math.log(most / least)) * (bottom - TOP);

  context.fillStyle = colour("calm");
  context.fillRect(LEFT, y(limit), width - LEFT - RIGHT, bottom - y(limit));
  context.lineWidth = 1;
  context.textAlign = "right";
  for (const mark of decades(least, most)) {
    line(context, [[LEFT, y(mark)], [width - RIGHT, y(mark)]], colour("grid"));
    text(context, lengthText(mark), LEFT - 8, y(mark) + 4, colour("muted"));
  }
  context.textAlign = "center";
  const step = evenStep(span, Math.max(3, width / 110));
  for (let time = 0; time <= span; time += step) {
    line(context, [[x(time), bottom], [x(time), height - AXIS]], colour("grid"));
    text(context, `${digits(time)} s`, x(time), height - 8, colour("muted"));
  }
  context.setLineDash([6, 4]);
  line(context, [[LEFT, y(limit)], [width - RIGHT, y(limit)]], colour("good"));
  context.setLineDash([]);
  context.textAlign = "right";
  text(context, `limit ${digits(limit * 1e6)} µm`, width - RIGHT - 4, y(limit) - 6, colour("good"));

  for (const { time, label, tone = "bad" } of marks) {
    line(context, [[x(time), TOP], [x(time), bottom]], colour(tone));
    context.textAlign = "left";
    text(context, label, x(time) + 4, TOP + 11, colour(tone));
  }
  context.save();
  context.beginPath();
  context.rect(LEFT, 0, width - LEFT - RIGHT, height);
  context.clip();
  context.lineJoin = "round";
  for (const [shown, name, thick] of [[reference, "faint", 2], [trace, "accent", 2.5]]) {
    if (!shown) continue;
    context.lineWidth = thick;
    line(context, points(shown, x, y, span), colour(name));
  }
  letters.forEach((_, chamber) => {
    const lane = height - AXIS - lanes + LANE * chamber;
    context.fillStyle = colour("lane");
    context.fillRect(LEFT, lane + 1, width - LEFT - RIGHT, LANE - 2);
  });
  context.fillStyle = colour("valve");
  for (const { time, chamber, duration } of injections)
    context.fillRect(x(time), height - AXIS - lanes + LANE * chamber + 1, Math.max(x(time + duration) - x(time), 1.5), LANE - 2);
  context.restore();
  context.textAlign = "right";
  letters.forEach((letter, chamber) =>
    text(context, `gas in ${letter.toUpperCase()}`, LEFT - 8, height - AXIS - lanes + LANE * chamber + 12, colour("muted")));
}

/** Largest amplitude of a trace, m. */
export function peak({ x, y }) {
  let most = 0;
  for (let i = 0; i < x.length; i++) most = Math.max(most, x[i] * x[i] + y[i] * y[i]);
  return Math.sqrt(most);
}

function* points({ time, x: px, y: py }, x, y, span) {
  const stride = Math.max(1, Math.ceil(time.length / 4000));
  for (let i = 0; i < time.length && time[i] <= span; i += stride) yield [x(time[i]), y(Math.hypot(px[i], py[i]))];
  const last = time.length - 1;
  if (time[last] <= span) yield [x(time[last]), y(Math.hypot(px[last], py[last]))];
}

function line(context, some, colour) {
  context.strokeStyle = colour;
  context.beginPath();
  for (const [x, y] of some) context.lineTo(x, y);
  context.stroke();
}

function text(context, words, x, y, colour) {
  context.fillStyle = colour;
  context.fillText(words, x, y);
}
