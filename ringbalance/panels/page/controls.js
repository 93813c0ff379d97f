// Controls of the page: what each is called, its unit, and how a slider stands for its range.

/** Every slider: group, label, unit as shown, SI value of the unit, path in a scene file; `log`, `further`, `none`. */
export const CONTROLS = {
  amplitude: { group: "Rotor", label: "Unbalance, as vibration before balancing", unit: "um", si: 1e-6, key: "rotor.initial_vibration.amplitude" },
  phase: { group: "Rotor", label: "Direction of the unbalance", unit: "deg", si: Math.PI / 180, key: "rotor.initial_vibration.phase", further: true },
  noise: { group: "Rotor", label: "Sensor noise", unit: "um", si: 1e-6, key: "sensor.amplitude_noise", note: "standard deviation of a reading" },
  phase_noise: { group: "Rotor", label: "Noise of the phase", unit: "deg", si: Math.PI / 180, key: "sensor.phase_noise", further: true },
  runout: { group: "Rotor", label: "Runout of the sensor's track", unit: "um", si: 1e-6, key: "sensor.runout.amplitude", further: true },
  pressure: { group: "Air", label: "Gas pressure", unit: "MPa", si: 1e6, key: "gas.pressure", note: "gauge" },
  leak: { group: "Air", label: "Leak of the distributor", unit: "l/(s*bar)", si: 1e-8, key: "gas.leak_to_ambient", further: true, note: "without effect while the valve acts at once" },
  gain: { group: "Controller", label: "Gain Kc (valve-open time per µm)", unit: "s/um", si: 1e6, key: "controller.proportional", log: true, of: ["target_vector"] },
  integral: { group: "Controller", label: "Integral time Ti", unit: "s", si: 1, key: "controller.integral_time", log: true, none: "none", of: ["target_vector"] },
  derivative: { group: "Controller", label: "Derivative time Td", unit: "s", si: 1, key: "controller.derivative_time", further: true, of: ["target_vector"] },
  offset: { group: "Controller", label: "Added to every valve-open time", unit: "ms", si: 1e-3, key: "controller.gas_time_offset", of: ["target_vector", "law_based"] },
  limit: { group: "Controller", label: "Limit: no correction below", unit: "um", si: 1e-6, key: "controller.limit", log: true },
};
export const STEPS = 1000;

/** Units as a reader knows them. */
export const shownUnit = (unit) => unit.replace("um", "µm").replace("deg", "°").replace("(s*bar)", "(s bar)");

/** A number with so many significant digits, without an exponent. */
export function digits(value, count = 3) {
  if (value === 0 || !Number.isFinite(value)) return String(value);
  const places = Math.max(0, Math.min(12, count - 1 - Math.floor(Math.log10(Math.abs(value)))));
  return String(Number(value.toFixed(places)));
}

/** Text of a length, m, in micrometres or, from one on, in millimetres. */
export const lengthText = (metres, count = 3) => (metres < 1e-3 ? `${digits(metres * 1e6, count)} µm` : `${digits(metres * 1e3, count)} mm`);

/** Text of a control's value, SI, with its unit. */
export function valueText({ unit, si, none }, value) {
  return value === null ? none : `${digits(value / si)} ${shownUnit(unit)}`;
}

/** Step of a slider, 0 to `STEPS`, at a value; null: at its end. */
export function stepOf({ log }, [low, high], value) {
  if (value === null) return STEPS;
  const part = log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  return Math.min(Math.max(part, 0), 1) * STEPS;
}

/** Value at a step of a slider, rounded as it is shown. */
export function valueAt({ log, none, si }, [low, high], step) {
  const part = step / STEPS;
  if (none && step >= STEPS) return null;
  const value = log ? low * (high / low) ** part : low + (high - low) * part;
  return Number(digits(value / si)) * si;
}

/** Settings that differ from the scene's, as blocks of a scene file. */
export function sceneBlocks(content, settings, scene) {
  const values = { controller: {}, gas: {}, rotor: {}, sensor: {} };
  const put = (path, text) => {
    const [table, ...key] = path.split(".");
    (values[table] ??= {})[key.join(".")] = text;
  };
  for (const [path, text] of Object.entries(content.designs[settings.design].values)) put(path, quoted(text));
  if (settings.algorithm !== scene.algorithm) put("controller.kind", `"${settings.algorithm}"`);
  for (const [path, text] of Object.entries(content.valves[settings.valve]?.changes ?? {})) put(path, quoted(text));
  for (const [name, { key, unit, si }] of Object.entries(CONTROLS)) {
    if (settings[name] === scene[name]) continue;
    if (settings[name] === null) put(key, "# none: leave this key out");
    else put(key, `"${digits(settings[name] / si, 6)} ${unit}"`);
  }
  const vibration = values.rotor;
  for (const name of ["amplitude", "phase"]) {
    const { key, unit, si } = CONTROLS[name];
    if (Object.keys(vibration).length) vibration[key.slice(6)] ??= `"${digits(settings[name] / si, 6)} ${unit}"`;
  }
  const tables = Object.entries(values).filter(([, keys]) => Object.keys(keys).length);
  const lines = tables.map(([table, keys]) => [`[${table}]`, ...Object.entries(keys).map(([key, text]) => `${key} = ${text}`)].join("\n"));
  return lines.length ? lines.join("\n\n") + "\n" : "# The settings are those of the scene.\n";
}

const quoted = (text) => (/^[-+.\d]+$/.test(text) ? text : `"${text}"`);
