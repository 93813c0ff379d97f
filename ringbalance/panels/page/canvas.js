// Canvases that fit their element and the screen, and the colours of the style sheet.

/** Context of a canvas, scaled so that one unit is one pixel of the page, with its size and the page's colours. */
export function prepared(canvas) {
  const { width, height } = canvas.getBoundingClientRect(), scale = window.devicePixelRatio || 1;
  const [w, h] = [Math.round(width * scale), Math.round(height * scale)];
  if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, { width: w, height: h });
  const context = canvas.getContext("2d"), style = getComputedStyle(canvas);
  const colour = (name) => style.getPropertyValue(`--${name}`).trim();
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = `13px ${style.fontFamily}`;
  return { context, width, height, colour };
}

/** Draw again after changes of size and palette, and in print, which has the light palette. */
export function whenSeenAnew(canvas, draw) {
  new ResizeObserver(draw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  for (const type of ["beforeprint", "afterprint"])
    addEventListener(type, () => {
      document.documentElement.classList.toggle("paper", type === "beforeprint");
      draw();
    });
}

/** Powers of ten and their halves, so that a logarithmic axis has few and round numbers. */
export function decades(low, high) {
  const marks = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power++) {
    const mark = 10 ** power;
    if (mark >= low && mark <= high) marks.push(mark);
  }
  return marks;
}

/** Steps of 1, 2 or 5 times a power of ten that divide a length into about `count` parts. */
export function evenStep(length, count) {
  const raw = length / count, power = 10 ** Math.floor(Math.log10(raw));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= raw);
}
