// Ranges of axes, their ticks, and the words at these: neighbours differ, and none is cut off.

const FONT = "11px system-ui, sans-serif";
const [SAME, WIDENED] = [1e-4, 0.1]; // Smaller changes than SAME of a value are none; a constant's surroundings.
const [NARROW, WIDE] = [24, 64]; // Room of a tick: up an axis and along one [px].

/** The range of an axis from the least to the greatest value; where these are about the same, with
    their surroundings. Without a value 0 to 1. room: on either side, in parts. No range passes 0
    where no value does. */
function rangeOf(low, high, room = 0) {
  if (!Number.isFinite(low) || !Number.isFinite(high)) return [0, 1];
  const size = Math.max(Math.abs(low), Math.abs(high));
  if (size === 0) return [0, 1];
  const more = high - low < SAME * size ? WIDENED * size : room * (high - low);
  return [low >= 0 ? Math.max(0, low - more) : low - more, high <= 0 ? Math.min(0, high + more) : high + more];
}

/** The same of a logarithmic axis, whose values are > 0. */
function logRangeOf(low, high) {
  if (!Number.isFinite(low) || !Number.isFinite(high)) return [0.1, 1];
  const more = high - low < SAME * high ? 1 + WIDENED : 1;
  return [low / more, high * more];
}

/** Whole multiples of a round step in a range, two at least, and the step. most: about so many. */
function evenTicks(low, high, most) {
  const hair = 1e-6 * (high - low);
  for (let step = niceStep((high - low) / most); step > hair; step = niceStep(step / 3)) {
    const [first, last] = [Math.ceil((low - hair) / step), Math.floor((high + hair) / step)];
    if (last > first) return { step, ticks: Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step) };
  }
  return { step: high - low, ticks: [low, high] };
}

/** 1, 2 and 5 times powers of ten, less of them where they would be closer than `least` decades; even
    ones, with their step, where the range holds fewer than two of these. */
function logTicks(low, high, least) {
  const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const inside = (tick) => tick >= low * (1 - 1e-6) && tick <= high * (1 + 1e-6);
  const some = (factors, each) => {
    const ticks = [];
    for (let power = Math.ceil(first / each) * each; power <= last; power += each) {
      ticks.push(...factors.map((factor) => Number(`${factor}e${power}`)));
    }
    return ticks.filter(inside);
  };
  const sets = [[[1, 2, 5], 1, 0.3], [[1, 3], 1, 0.47]];
  for (let each = 1; each <= last - first; each++) sets.push([[1], each, each]);
  const [factors, each] = sets.find(([, , gap]) => gap >= least) ?? sets[0];
  const ticks = some(factors, each);
  return ticks.length > 1 ? { ticks } : evenTicks(low, high, Math.log10(high / low) / least);
}

/** Ticks in words. Those with a step share digits, and a power of ten where they are large or small. */
function tickWords(ticks, step) {
  const power = (size) => (size >= 1e6 || size < 1e-3 ? Math.floor(Math.log10(size) + 1e-9) : 0);
  const least = (size) => Math.floor(Math.log10(size) + 1e-9);
  const shared = step ? power(Math.max(...ticks.map(Math.abs))) : 0;
  return ticks.map((tick) => {
    if (Math.abs(tick) < (step ?? 0) / 2) return "0";
    const own = step ? shared : power(tick);
    const text = written(tick / 10 ** own, Math.max(0, own - least(step ?? tick)));
    const grouped = text.replace(/^\D?\d{4,}/, (whole) => whole.replace(/\B(?=(\d{3})+$)/g, ","));
    return own ? `${grouped}e${String(own).replace("-", "−")}` : grouped;
  });
}

/** An axis for uPlot. log: see Chart. The rest of its look is in `more`. */
function axisWith(along, log, more) {
  const found = (plot, low, high) => {
    const room = (along ? plot.bbox.width : plot.bbox.height) / uPlot.pxRatio / (along ? WIDE : NARROW);
    return log ? logTicks(low, high, Math.log10(high / low) / room) : evenTicks(low, high, Math.max(room, 2));
  };
  let now = { ticks: [] };
  return {
    stroke: colour("muted"), grid: { stroke: colour("rule"), width: 1 }, font: FONT, ticks: { size: 4 }, space: 20,
    incrs: (_, axis, low, high) => [Math.max(5, high - low)], // uPlot's own search, with one answer.
    splits: (plot, axis, low, high) => (now = found(plot, low, high)).ticks,
    filter: (_, ticks) => ticks,
    values: () => tickWords(now.ticks, now.step),
    ...more,
  };
}

/** The width of an axis that holds its words. */
function widthOf(plot, words) {
  plot.ctx.save();
  plot.ctx.font = FONT;
  const widest = Math.max(0, ...(words ?? []).map((one) => plot.ctx.measureText(one).width));
  plot.ctx.restore();
  return Math.max(34, Math.ceil(widest) + 13); // The tick, 4, the gap behind it, 5, and air.
}
