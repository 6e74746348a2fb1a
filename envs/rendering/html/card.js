// One player: numbers of the moment, the machine, what happened, and a strip over time.

class Card {
  constructor(episode, index, seek) {
    Object.assign(this, { episode, index, seek });
    this.last = episode.panels[0].lines[0].values.length - 1;
    this.home = element("article", { class: "card", "aria-label": episode.name });
    this.swatch = element("i", { class: "swatch", "aria-hidden": "true" });
    this.badge = element("span", { class: "badge" });
    this.home.append(element("h2", {}, this.swatch, element("span", {}, episode.name), this.badge));
    this.values = episode.numbers.map(([title, , digits]) => {
      const shown = element("dd", {});
      return { row: element("div", {}, element("dt", {}, title), shown), shown, digits };
    });
    this.home.append(element("dl", { class: "numbers" }, ...this.values.map((one) => one.row)));
    if (episode.drawing) this.addPicture();
    if (episode.facts.length) this.home.append(facts(episode.facts));
    if (episode.events.length) this.home.append(this.eventList());
    this.strip = element("canvas", { class: "strip", "aria-hidden": "true", title: `${episode.name}: a click goes there` });
    this.strip.addEventListener("click", (event) => seek((event.offsetX / this.strip.clientWidth) * this.span));
    this.recolour();
  }

  addPicture() {
    const canvas = element("canvas", { class: "picture" });
    const words = `${this.episode.name}: the machine on its ground, with friction cone, ground force and slip marks`;
    this.picture = new Picture(canvas, this.episode.drawing, words);
    this.legend = this.episode.drawing.legend.map(([role, meaning]) => {
      const patch = element("i", { "aria-hidden": "true" });
      return { role, patch, item: element("li", {}, patch, meaning) };
    });
    const list = element("ul", { class: "legend", "aria-label": "Colours" }, ...this.legend.map((one) => one.item));
    this.home.append(canvas, list);
  }

  eventList() {
    const items = this.episode.events.map((event) => {
      const time = event.sample * this.episode.period;
      const button = element("button", { type: "button" }, `${written(time, 2)} s  ${event.words}`);
      button.addEventListener("click", () => this.seek(time));
      return element("li", {}, button);
    });
    const title = element("summary", {}, `Events (${items.length})`);
    return element("details", { class: "events" }, title, element("ol", {}, ...items));
  }

  recolour() {
    this.swatch.style.background = colour(`player-${this.index % 6}`);
    for (const one of this.legend || []) one.patch.style.background = colour(one.role);
    if (this.picture) this.picture.forgetColours();
  }

  /** The sample at a time, a fraction between two of them; the last one after the end. */
  sample(time) {
    return Math.max(0, Math.min(this.last, time / this.episode.period));
  }

  state(at) {
    const { ended, slips } = this.episode;
    if (ended && at >= this.last - 1e-6) return [ended.toUpperCase(), "ended"];
    if (!slips) return ["", "holds"];
    const [sticks, slipping] = this.episode.states;
    return value(slips, at) > 0 ? [slipping, "slides"] : [sticks, "holds"];
  }

  show(time) {
    const at = this.sample(time);
    if (this.picture) this.picture.draw(at);
    this.episode.numbers.forEach(([, numbers], i) => {
      this.values[i].shown.textContent = written(value(numbers, at), this.values[i].digits);
    });
    const [word, tone] = this.state(at);
    this.badge.textContent = word;
    this.badge.style.background = colour(`badge-${tone}`);
    this.badge.hidden = !word;
  }

  /** The moment in words, for a screen reader. */
  words(time) {
    const at = this.sample(time);
    const numbers = this.episode.numbers.map(([title, all, digits]) => `${title} ${written(value(all, at), digits)}`);
    return `${this.episode.name}: ${[this.state(at)[0].toLowerCase(), ...numbers].filter(Boolean).join(", ")}`;
  }

  /** Bands where it slips, a tick for each exchange of support, a bar at an early end. */
  drawStrip(span) {
    this.span = span;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [this.strip.clientWidth, this.strip.clientHeight];
    this.strip.width = Math.round(width * ratio);
    this.strip.height = Math.round(height * ratio);
    const context = this.strip.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { period, slips, events, ended } = this.episode;
    const place = (sample) => (sample * period * width) / span;
    context.fillStyle = colour(`player-${this.index % 6}`);
    context.fillRect(0, 0, 4, height);
    context.fillStyle = colour("panel");
    context.fillRect(4, 2, Math.max(0, place(this.last) - 4), height - 4);
    context.fillStyle = colour("slides");
    const band = (from, to) => context.fillRect(from, 4, Math.max(1, to - from), height - 8);
    for (let i = 1; slips && i <= this.last; i++) if (slips[i] > 0) band(place(i - 1), place(i));
    for (const event of events) {
      if (event.kind !== "support") continue;
      context.fillStyle = colour("muted");
      context.fillRect(place(event.sample), 1, 1.5, height - 2);
    }
    if (ended) {
      context.fillStyle = colour("ink");
      context.fillRect(Math.min(width - 4, place(this.last)), 0, 4, height);
    }
  }
}

/** A list of terms with their words. */
function facts(rows) {
  const items = rows.map(([term, words]) => element("div", {}, element("dt", {}, term), element("dd", {}, words)));
  return element("dl", { class: "facts" }, ...items);
}
