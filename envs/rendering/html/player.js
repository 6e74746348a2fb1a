// The clock that all players share, and what drives it: buttons, the slider and keys.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
/** Inside another page the episode repeats. */
const EMBEDDED = window.self !== window.top;
const HINT = "Keys: space plays, ← → a step (with shift half a second), Home and End, − and + the speed, D dark or light.";

class Player {
  constructor(home, charts, episodes) {
    this.episodes = episodes;
    this.time = 0;
    this.playing = false;
    this.end = Math.max(...episodes.map((one) => (times(one).length - 1) * one.period));
    this.period = Math.min(...episodes.map((one) => one.period));
    const seek = (time) => this.seek(time);
    this.cards = episodes.map((episode, index) => new Card(episode, index, seek));
    const alone = episodes.length === 1 ? " one" : "";
    home.append(element("div", { class: `cards${alone}` }, ...this.cards.map((card) => card.home)), this.controls());
    home.hidden = charts.hidden = false;
    this.charts = panelCharts(charts, episodes, seek, this.end);
    this.fit();
    new ResizeObserver(() => this.fit()).observe(home);
    document.addEventListener("keydown", (event) => this.key(event));
  }

  button(words, label, action, kind = "") {
    const made = element("button", { type: "button", class: kind, "aria-label": label, title: label }, words);
    made.addEventListener("click", action);
    return made;
  }

  controls() {
    this.play = this.button("▶ Play", "Play (space)", () => this.toggle(), "play");
    this.speed = element("select", { "aria-label": "Speed" });
    for (const speed of SPEEDS) this.speed.append(element("option", { value: String(speed) }, `${speed} ×`));
    this.speed.value = "1";
    this.clock = element("span", { class: "time" });
    this.slider = element("input", {
      type: "range", min: "0", max: String(this.end), step: "any", value: "0", "aria-label": "Time",
    });
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.voice = element("p", { class: "offscreen", "aria-live": "polite" });
    const buttons = element(
      "div", { class: "buttons" }, this.play,
      this.button("Start", "To the start (Home)", () => this.seek(0)),
      this.button("◀", "A step back (left arrow)", () => this.step(-1)),
      this.button("▶︎", "A step forward (right arrow)", () => this.step(1)), this.speed, this.clock,
    );
    const any = (condition) => this.episodes.some(condition);
    const legend = [
      any((one) => one.slips) ? "Orange: slips. " : "",
      any((one) => one.events.some((event) => event.kind === "support")) ? "Fine lines: the legs change support. " : "",
      any((one) => one.ended) ? "A bar across the strip: the end before its time. " : "",
    ].join("");
    return element(
      "div", { class: "controls" }, buttons, this.slider, ...this.cards.map((card) => card.strip),
      element("p", { class: "hint" }, `${legend}${HINT}`), this.voice,
    );
  }

  fit() {
    for (const card of this.cards) card.drawStrip(this.end);
    for (const chart of this.charts) chart.resize();
    this.show();
  }

  recolour() {
    for (const card of this.cards) card.recolour();
    for (const chart of this.charts) chart.build();
    this.fit();
    this.tell();
  }

  show() {
    for (const card of this.cards) card.show(this.time);
    for (const chart of this.charts) chart.show(this.time);
    this.slider.value = String(this.time);
    const words = `${written(this.time, 2)} s of ${written(this.end, 2)} s`;
    this.clock.textContent = words;
    this.slider.setAttribute("aria-valuetext", words);
  }

  /** Values in the legends, and the moment in words. */
  tell() {
    for (const chart of this.charts) chart.tell(this.time);
    this.voice.textContent = `${written(this.time, 2)} s. ${this.cards.map((card) => card.words(this.time)).join(". ")}`;
  }

  seek(time) {
    this.time = Math.max(0, Math.min(this.end, time));
    this.show();
    if (!this.playing) this.tell();
  }

  step(count) {
    this.pause();
    this.seek((Math.round(this.time / this.period) + count) * this.period);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.start();
  }

  start() {
    if (this.time >= this.end) this.time = 0;
    this.playing = true;
    this.play.textContent = "❚❚ Pause";
    this.play.setAttribute("aria-label", "Pause (space)");
    let before = null;
    const frame = (now) => {
      if (!this.playing) return;
      const passed = before === null ? 0 : Math.min(0.1, (now - before) / 1000);
      before = now;
      this.seek(this.time + passed * Number(this.speed.value));
      if (this.time >= this.end && EMBEDDED) this.time = 0;
      if (this.time >= this.end) this.pause();
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  pause() {
    this.playing = false;
    this.play.textContent = "▶ Play";
    this.play.setAttribute("aria-label", "Play (space)");
    this.tell();
  }

  faster(count) {
    const index = SPEEDS.indexOf(Number(this.speed.value)) + count;
    this.speed.value = String(SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, index))]);
  }

  key(event) {
    const busy = event.target instanceof Element ? event.target.closest("input, select, button, summary") : null;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === " " && busy && !busy.matches("input")) return;
    if (busy && busy.matches("select")) return;
    const far = Math.max(1, Math.round(0.5 / this.period));
    const actions = {
      " ": () => this.toggle(),
      ArrowLeft: () => this.step(event.shiftKey ? -far : -1),
      ArrowRight: () => this.step(event.shiftKey ? far : 1),
      Home: () => this.seek(0),
      End: () => this.seek(this.end),
      "-": () => this.faster(-1),
      "+": () => this.faster(1),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }
}
