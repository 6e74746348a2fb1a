// What the page holds, as arrays. Python computed every number of it (envs/rendering/page.py).

/** An array of page.py: little-endian float32. */
function decode(entry) {
  const bytes = Uint8Array.from(atob(entry.data), (letter) => letter.charCodeAt(0));
  const values = new Float32Array(bytes.buffer);
  values.width = entry.shape.slice(1).reduce((product, size) => product * size, 1);
  return values;
}

/** The same tree with every encoded array decoded. */
function decodeAll(value) {
  if (Array.isArray(value)) return value.map(decodeAll);
  if (value === null || typeof value !== "object") return value;
  if (typeof value.data === "string" && Array.isArray(value.shape)) return decode(value);
  return Object.fromEntries(Object.entries(value).map(([name, one]) => [name, decodeAll(one)]));
}

/** Row `at` of an array, between two samples where `at` is no whole number. */
function row(values, at) {
  const count = values.length / values.width;
  const first = Math.min(Math.floor(at), count - 1);
  const next = Math.min(first + 1, count - 1);
  const share = Math.min(at - first, 1);
  const found = new Array(values.width);
  for (let i = 0; i < values.width; i++) {
    const a = values[first * values.width + i];
    const b = values[next * values.width + i];
    found[i] = share > 0 && Number.isFinite(b) ? a + share * (b - a) : a;
  }
  return found;
}

/** The value of the nearest sample that is not after `at`, to a hair. */
function value(values, at) {
  return values[Math.min(Math.floor(at + 1e-6), values.length - 1)];
}

/** A number with its digits and a true minus sign; a dash for none. */
function written(number, digits) {
  if (!Number.isFinite(number)) return "–";
  const text = number.toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text.replace("-", "−");
}

/** A round step that is not below `rough`: 1, 2 or 5 times a power of ten. */
function niceStep(rough) {
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= rough * 0.999);
}

/** A new element with its attributes and children; words become text, never markup. */
function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, one] of Object.entries(attributes)) made.setAttribute(key, one);
  made.append(...children);
  return made;
}

/** A colour of the page by its name in theme.py. */
function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}
