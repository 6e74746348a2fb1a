// The ground below the machine and what it exerts: stretches of friction, slides, cones and forces.

const [HEAD, HEAD_WIDTH, SHAFT_WIDTH] = [12, 10, 3.6];

Object.assign(Picture.prototype, {
  /** Height of the ground at x, along its profile. */
  heightAt(x) {
    const { ground } = this.drawing;
    const count = ground.length / 2;
    let low = 0;
    let high = count - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (ground[2 * middle] <= x) low = middle;
      else high = middle;
    }
    const [xa, ya, xb, yb] = ground.slice(2 * low, 2 * low + 4);
    return ya + ((yb - ya) * Math.max(0, Math.min(1, (x - xa) / (xb - xa || 1))));
  },

  profile(start, end) {
    const { ground } = this.drawing;
    const points = [[start, this.heightAt(start)]];
    for (let i = 0; i < ground.length; i += 2) {
      if (ground[i] > start && ground[i] < end) points.push([ground[i], ground[i + 1]]);
    }
    return [...points, [end, this.heightAt(end)]];
  },

  drawGround() {
    const { context, size, scale } = this;
    const [left, right] = [this.x0, this.x0 + size[0] / scale];
    const bottom = this.y0 - 1;
    for (const stretch of this.drawing.stretches) {
      const start = Math.max(stretch.start, left - 0.1);
      const end = Math.min(stretch.end, right + 0.1);
      if (start >= end) continue;
      const points = this.profile(start, end);
      this.path([...points, [end, bottom], [start, bottom]], true);
      context.save();
      context.globalAlpha = Number(this.colour("ground-alpha"));
      context.fillStyle = stretch.colour;
      context.fill();
      context.restore();
      if (stretch.icy) this.drawGlints();
      this.path(points);
      context.lineWidth = 1.6;
      context.strokeStyle = this.colour("ink");
      context.stroke();
      this.label(stretch.words, start, end);
    }
  },

  /** Slanting strokes on what was filled last, which stay where they are on the ice. */
  drawGlints() {
    const { context, size, scale } = this;
    const pitch = 26 / scale;
    context.save();
    context.clip();
    context.strokeStyle = "rgb(255 255 255 / 45%)";
    context.lineWidth = 2;
    const first = Math.floor(this.x0 / pitch) - 4;
    for (let i = first; i < first + size[0] / 26 + 8; i++) {
      if (![0, 1, 3].includes(((i % 5) + 5) % 5)) continue;
      const [x] = this.at(i * pitch, 0);
      context.beginPath();
      context.moveTo(x, size[1]);
      context.lineTo(x + size[1] / 3, size[1] * (2 / 3));
      context.stroke();
    }
    context.restore();
  },

  label(words, start, end) {
    const { context, size } = this;
    context.font = "12px system-ui, sans-serif";
    const [a, b] = [Math.max(0, this.at(start, 0)[0]), Math.min(size[0], this.at(end, 0)[0])];
    if (b - a < context.measureText(words).width + 8) return;
    context.textAlign = "center";
    context.fillStyle = this.colour("ink");
    context.fillText(words, (a + b) / 2, size[1] - 23);
  },

  drawScale() {
    const { context, size, scale } = this;
    const step = niceStep(70 / scale);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    context.fillStyle = context.strokeStyle = this.colour("ink");
    context.lineWidth = 1;
    const last = Math.floor((this.x0 + size[0] / scale) / step);
    for (let i = Math.ceil(this.x0 / step); i <= last; i++) {
      const [x] = this.at(i * step, 0);
      context.beginPath();
      context.moveTo(x, size[1]);
      context.lineTo(x, size[1] - 5);
      context.stroke();
      if (x > 20 && x < size[0] - 20) {
        context.fillText(`${written(i * step, digits)} m`, x, size[1] - 8);
      }
    }
  },

  /** Where the foot slid so far, with the lengths of the latest slides that have room. */
  drawMarks(at) {
    const { context, drawing } = this;
    const marks = drawing.marks || [];
    const taken = [];
    context.strokeStyle = this.colour("slides");
    context.fillStyle = this.colour("ink");
    context.lineWidth = 5;
    context.lineCap = "butt";
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    for (let i = marks.length - 4; i >= 0; i -= 4) {
      const [sample, low, high, length] = marks.slice(i, i + 4);
      if (sample > at + 1e-6) continue;
      const [x, y] = this.at(low, this.heightAt(low));
      const wide = Math.max(1, (high - low) * this.scale);
      if (x + wide < 0 || x > this.size[0]) continue;
      context.beginPath();
      context.moveTo(x, y + 3);
      context.lineTo(x + wide, y + 3);
      context.stroke();
      const middle = x + wide / 2;
      if (!(length >= 5e-4) || taken.some((one) => Math.abs(one - middle) < 52)) continue;
      taken.push(middle);
      context.fillText(`${written(1000 * length, length >= 9.95e-3 ? 0 : 1)} mm`, middle, y + 18);
    }
    context.lineCap = "round";
  },

  /** Where the contact is at an instant, with its numbers; null where nothing is touched. */
  contactAt(contact, at) {
    const near = Math.min(Math.round(at), contact.normal.length - 1);
    const [a, b] = [Math.floor(at), Math.min(Math.floor(at) + 1, contact.normal.length - 1)];
    const whole = Number.isFinite(contact.normal[a]) && Number.isFinite(contact.normal[b]);
    const time = whole ? at : near;
    const normal = row(contact.normal, time)[0];
    if (!Number.isFinite(normal)) return null;
    const slips = value(contact.slips, near) > 0;
    const [place, slope] = [row(contact.place, time), row(contact.slope, time)[0]];
    return { place, slope, normal, near, slips, friction: row(contact.friction, time)[0] };
  },

  drawCone(contact, at) {
    const now = this.contactAt(contact, at);
    const mu = now && contact.mu_static[now.near];
    if (!now || !Number.isFinite(mu)) return;
    const { context } = this;
    const tone = this.colour(now.slips ? "slides" : "holds");
    const up = now.slope + Math.PI / 2;
    const rim = (angle, [x, y] = now.place) => [
      x + this.drawing.reach * Math.cos(angle), y + this.drawing.reach * Math.sin(angle),
    ];
    const half = Math.atan(mu);
    const arc = Array.from({ length: 17 }, (_, i) => rim(up - half + (half * i) / 8));
    this.path([now.place, ...arc], true);
    context.fillStyle = context.strokeStyle = tone;
    context.globalAlpha = 0.16;
    context.fill();
    context.globalAlpha = 0.75;
    context.lineWidth = 0.8;
    context.stroke();
    context.globalAlpha = 1;
    const kinetic = contact.mu_kinetic[now.near];
    if (!(kinetic < mu)) return;
    context.setLineDash([3, 2.4]);
    context.lineWidth = 1.2;
    context.strokeStyle = this.colour("slides");
    for (const side of [-1, 1]) {
      this.path([now.place, rim(up + side * Math.atan(kinetic))]);
      context.stroke();
    }
    context.setLineDash([]);
  },

  /** The force of the ground as an arrow out of it. */
  drawForce(contact, at) {
    const now = this.contactAt(contact, at);
    if (!now) return;
    const { context, drawing, unit } = this;
    const tone = this.colour(now.slips ? "slides" : "holds");
    const size = Math.hypot(now.friction, now.normal);
    const most = 3.4 * drawing.force;
    const long = Math.min((size / drawing.weight) * drawing.force, most) * this.scale;
    const angle = now.slope + Math.atan2(now.normal, now.friction);
    context.save();
    context.translate(...this.at(...now.place));
    context.rotate(-angle);
    const head = Math.min(HEAD * unit, long);
    const [shaft, barb] = [(SHAFT_WIDTH / 2) * unit, (HEAD_WIDTH / 2) * unit];
    context.beginPath();
    const neck = long - head;
    const corners = [[0, -shaft], [neck, -shaft], [neck, -barb], [long, 0], [neck, barb], [neck, shaft], [0, shaft]];
    corners.forEach(([x, y], i) => context[i ? "lineTo" : "moveTo"](x, y));
    context.closePath();
    context.fillStyle = tone;
    context.strokeStyle = this.colour("page");
    context.lineWidth = 1.4;
    context.stroke();
    context.fill();
    context.restore();
  },

  /** Points of the ground that a policy observes. */
  drawSeen(at) {
    if (!this.drawing.seen) return;
    const { context } = this;
    const seen = row(this.drawing.seen, at);
    context.strokeStyle = this.colour("motor");
    context.fillStyle = this.colour("page");
    context.lineWidth = 1.4;
    for (let i = 0; i < seen.length; i += 2) {
      context.beginPath();
      context.arc(...this.at(seen[i], seen[i + 1]), 2.5, 0, 2 * Math.PI);
      context.fill();
      context.stroke();
    }
  },
});
