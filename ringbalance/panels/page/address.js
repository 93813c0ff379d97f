// State in the address: what differs from the scene, so that a link reproduces a run. Anything else is ignored.
import { CONTROLS, digits } from "./controls.js";

const MOST_LOADS = 20;
const SPEEDS = [1, 2, 5, 10, 20, 60];

/** Text behind "#" for a state. */
export function written(state, scene) {
  const { settings } = state, parts = [];
  for (const [name, { si }] of Object.entries(CONTROLS))
    if (settings[name] !== scene[name]) parts.push([name, settings[name] === null ? "none" : digits(settings[name] / si, 6)]);
  for (const name of ["algorithm", "valve", "design"])
    if (settings[name] !== scene[name]) parts.push([name, settings[name]]);
  if (!settings.mass) parts.push(["mass", 0]);
  if (state.device !== null) parts.push(["device", state.device + 1]);
  if (state.seed !== 1) parts.push(["seed", state.seed]);
  if (state.speed !== 5) parts.push(["speed", state.speed]);
  for (const { time, x, y } of state.loads) parts.push(["load", [time, x * 1e6, y * 1e6].map((part) => digits(part, 6)).join(",")]);
  return parts.map((part) => part.join("=")).join("&");
}

/** State of an address; a part that is unknown or out of range is left out. */
export function read(text, content, scene) {
  const state = { settings: { ...scene }, device: null, seed: 1, speed: 5, loads: [] };
  for (const part of String(text).replace(/^#/, "").slice(0, 2000).split("&")) {
    const [name, value] = part.split("=");
    if (value !== undefined) take(state, name, value, content);
  }
  if (state.device !== null && state.device >= content.designs[state.settings.design].count) state.device = null;
  return state;
}

function take(state, name, text, content) {
  const { settings } = state, value = numeric(text);
  const whole = (low, high) => Number.isInteger(value) && value >= low && value <= high;
  if (Object.hasOwn(CONTROLS, name)) {
    const [low, high] = content.ranges[name], { si, none } = CONTROLS[name];
    if (none && text === none) settings[name] = null;
    else if (value * si >= low * (1 - 1e-3) && value * si <= high * (1 + 1e-3)) settings[name] = value * si;
  } else if (name === "algorithm" && Object.hasOwn(content.rules.rises, text)) settings.algorithm = text;
  else if (name === "valve" && whole(-1, content.valves.length - 1)) settings.valve = value;
  else if (name === "design" && whole(0, content.designs.length - 1)) settings.design = value;
  else if (name === "mass" && value === 0) settings.mass = false;
  else if (name === "device" && whole(1, 64)) state.device = value - 1;
  else if (name === "seed" && whole(1, 999999)) state.seed = value;
  else if (name === "speed" && SPEEDS.includes(value)) state.speed = value;
  else if (name === "load" && state.loads.length < MOST_LOADS) {
    const [time, x, y, ...more] = text.split(",").map(numeric);
    const most = content.ranges.amplitude[1] * 1e6;
    if (!more.length && time >= 0 && time <= 3600 && Math.hypot(x, y) <= most) state.loads.push({ time, x: x * 1e-6, y: y * 1e-6 });
  }
}

const numeric = (text) => (/^-?\d{1,9}(\.\d{1,9})?$/.test(text ?? "") ? Number(text) : NaN);
