// Path of the vibration in the frame of the disc; the distance from the centre is logarithmic beyond the limit.
import { decades, prepared } from "./canvas.js";
import { lengthText } from "./controls.js";
import { peak } from "./time_plot.js";

/** Draw a trace. `view`: `trace` (x, y, m), `limit`, and optionally `reference`, another trace. */
export function drawPolarPlot(canvas, { trace, limit, reference }) {
  const { context, width, height, colour } = prepared(canvas);
  const most = Math.max(peak(trace), reference ? peak(reference) : 0, 3 * limit) * 1.15;
  const size = Math.min(width / 2 - 44, height / 2 - 20), labels = [];
  if (size <= 0) return;
  const radius = (amplitude) => (size * Math.log1p((2 * amplitude) / limit)) / Math.log1p((2 * most) / limit);
  const place = (x, y) => {
    const amplitude = Math.hypot(x, y), factor = amplitude > 0 ? radius(amplitude) / amplitude : 0;
    return [factor * x, -factor * y];
  };
  context.translate(width / 2, height / 2);
  context.fillStyle = colour("calm");
  circle(context, radius(limit));
  context.fill();
  context.strokeStyle = colour("grid");
  context.lineWidth = 1;
  for (const mark of decades(limit * 1.5, most)) {
    circle(context, radius(mark));
    context.stroke();
    labels.push([lengthText(mark), radius(mark) - 4]);
  }
  for (const [x, y, label] of [[1, 0, "0°"], [0, 1, "90°"], [-1, 0, "180°"], [0, -1, "270°"]]) {
    context.beginPath();
    context.moveTo(0, 0);
    context.lineTo(size * x, -size * y);
    context.stroke();
    context.fillStyle = colour("muted");
    context.textAlign = x > 0 ? "left" : x < 0 ? "right" : "center";
    context.fillText(label, (size + 6) * x, -(size + 9) * y + 4);
  }
  context.setLineDash([6, 4]);
  context.strokeStyle = colour("good");
  circle(context, radius(limit));
  context.stroke();
  context.setLineDash([]);
  context.lineJoin = "round";
  for (const [shown, name] of [[reference, "faint"], [trace, "accent"]]) {
    if (!shown) continue;
    context.strokeStyle = colour(name);
    context.lineWidth = 2;
    context.beginPath();
    const stride = Math.max(1, Math.ceil(shown.x.length / 4000));
    for (let i = 0; i < shown.x.length; i += stride) context.lineTo(...place(shown.x[i], shown.y[i]));
    context.stroke();
  }
  context.textAlign = "center";
  context.fillStyle = colour("muted");
  // A halo keeps lines off the labels.
  Object.assign(context, { strokeStyle: colour("card"), lineWidth: 5 });
  for (const [label, y] of labels) for (const part of ["strokeText", "fillText"]) context[part](label, 0, y);
  const [x, y] = place(trace.x.at(-1), trace.y.at(-1));
  context.translate(x, y);
  context.fillStyle = colour("accent");
  circle(context, 5);
  context.fill();
}

function circle(context, radius) {
  context.beginPath();
  context.arc(0, 0, radius, 0, 2 * Math.PI);
}
