// Curves over time, by uPlot.

const DASH = [7, 4];
const AXIS = "time [s]";
const FONT = "11px system-ui, sans-serif";
const FEW = 12; // Samples that are marked each: of one or two a line shows nothing, or little.

/** One chart: lines over time, with a playhead. */
class Chart {
  constructor(home, title, unit, series, { limits, steps, seek, span }) {
    this.home = element("div", { class: "chart" });
    const heading = element("h2", {}, title, " ", element("small", {}, unit === "-" ? "" : `[${unit}]`));
    this.place = element("div", { role: "img", "aria-label": `${title} over time` });
    this.home.append(heading, this.place);
    home.append(this.home);
    Object.assign(this, { series, limits, steps, seek, span });
    this.data = joined(series);
    this.head = element("div", { class: "playhead" });
    this.build();
  }

  build() {
    if (this.plot) this.plot.destroy();
    const look = { stroke: colour("muted"), grid: { stroke: colour("rule"), width: 1 }, font: FONT, ticks: { size: 4 } };
    const axes = [{ ...look, size: 34, label: AXIS, labelSize: 16, labelFont: FONT }, { ...look, size: 58, space: 22 }];
    const paths = this.steps ? uPlot.paths.stepped({ align: -1 }) : undefined;
    const lines = this.series.map((one) => ({
      label: one.label, stroke: one.colour(), width: 1.5, dash: one.dash, paths, points: { show: this.data[0].length <= FEW, size: 6 },
      value: (_, number) => (number == null ? "–" : brief(number)),
    }));
    const options = {
      width: Math.max(200, this.home.clientWidth), height: 170, axes, padding: [8, 26, 0, 0],
      series: [{ label: AXIS, value: (_, number) => (number == null ? "–" : brief(number)) }, ...lines],
      scales: {
        x: { time: false, range: [0, this.span] },
        y: { range: (_, low, high) => this.range(low, high) },
      },
      cursor: { drag: { x: false, y: false }, sync: { key: "clock" } },
      hooks: { draw: [(plot) => this.drawLimits(plot)] },
    };
    this.plot = new uPlot(options, this.data, this.place);
    this.plot.over.append(this.head);
    this.plot.over.addEventListener("click", (event) => this.seek(this.plot.posToVal(event.offsetX, "x")));
  }

  /** Of y: all values and limits. */
  range(low, high) {
    const known = [low, high, ...this.limits].filter(Number.isFinite);
    return known.length ? uPlot.rangeNum(Math.min(...known), Math.max(...known), 0.06, true) : [0, 1];
  }

  drawLimits(plot) {
    const { ctx: context, bbox } = plot;
    context.save();
    context.strokeStyle = colour("muted");
    context.lineWidth = 1;
    context.setLineDash([5, 4]);
    for (const level of this.limits) {
      const y = plot.valToPos(level, "y", true);
      context.beginPath();
      context.moveTo(bbox.left, y);
      context.lineTo(bbox.left + bbox.width, y);
      context.stroke();
    }
    context.restore();
  }

  show(time) {
    this.head.style.transform = `translateX(${this.plot.valToPos(time, "x")}px)`;
  }

  /** The values at a time in the legend. */
  tell(time) {
    this.plot.setLegend({ idx: this.plot.valToIdx(time) });
  }

  resize() {
    this.plot.setSize({ width: Math.max(200, this.home.clientWidth), height: 170 });
  }
}

/** uPlot's columns: one x for all series, null where a series has no value there. */
function joined(series) {
  const tables = series.map((one) => [
    Array.from(one.x), Array.from(one.values, (number) => (Number.isFinite(number) ? number : null)),
  ]);
  return tables.length > 1 ? uPlot.join(tables) : tables[0];
}

/** About four figures. */
function brief(number) {
  const size = Math.abs(number);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) return number.toExponential(2).replace("+", "").replaceAll("-", "−");
  return written(number, size < 10 ? 3 : size < 100 ? 2 : size < 1000 ? 1 : 0);
}

/** The panels of all episodes: those of one line (and dashed ones) hold all players, others are one a
    player. What is called the same in another unit stands apart. */
function panelCharts(home, episodes, seek, span) {
  const charts = [];
  const several = episodes.length > 1;
  const kind = (panel) => `${panel.title} [${panel.unit}]`;
  const kinds = [...new Set(episodes.flatMap((one) => one.panels.map(kind)))];
  for (const wanted of kinds) {
    const owners = episodes.map((episode, index) => ({
      episode, index, panel: episode.panels.find((panel) => kind(panel) === wanted),
    })).filter((one) => one.panel);
    const { title, unit, steps } = owners[0].panel;
    const limits = [...new Set(owners.flatMap((owner) => owner.panel.limits))];
    const look = { limits, steps, seek, span };
    const one = (owner, line, label, tone) => ({
      label, x: times(owner.episode), values: line.values, dash: line.dashed ? DASH : [], colour: tone,
    });
    const solid = ({ panel }) => panel.lines.filter((line) => !line.dashed);
    if (owners.every((owner) => solid(owner).length === 1)) {
      const own = (owner) => () => colour(`player-${owner.index % 6}`);
      const series = owners.map((owner) => one(
        owner, solid(owner)[0], several ? owner.episode.name : solid(owner)[0].name, own(owner),
      ));
      const dashed = owners.flatMap((owner) => owner.panel.lines.filter((line) => line.dashed).map((line) => ({ owner, line })));
      const shared = dashed.every(({ line }) => line.name === dashed[0].line.name && sameCourse(line.values, dashed[0].line.values));
      for (const { owner, line } of shared ? dashed.slice(0, 1) : dashed) {
        const label = shared ? line.name : `${line.name}, ${owner.episode.name}`;
        series.push(one(owner, line, label, shared ? () => colour("muted") : own(owner)));
      }
      charts.push(new Chart(home, title, unit, series, look));
      continue;
    }
    for (const owner of owners) {
      const series = owner.panel.lines.map((line, i) => one(
        owner, line, line.name, () => (line.dashed ? colour("muted") : colour(`player-${i % 6}`)),
      ));
      const named = several ? `${title}: ${owner.episode.name}` : title;
      charts.push(new Chart(home, named, unit, series, { ...look, limits: owner.panel.limits }));
    }
  }
  return charts;
}

/** Whether two lines are about the same as long as both last. */
function sameCourse(one, other) {
  const count = Math.min(one.length, other.length);
  for (let i = 0; i < count; i++) {
    const near = Math.abs(one[i] - other[i]) <= 1e-4 * Math.max(Math.abs(one[i]), Math.abs(other[i]));
    if (!near && !(Number.isNaN(one[i]) && Number.isNaN(other[i]))) return false;
  }
  return true;
}

/** The times of an episode's samples [s]. */
function times(episode) {
  const count = episode.panels[0].lines[0].values.length;
  return Array.from({ length: count }, (_, i) => i * episode.period);
}
