// The machine on a canvas. All positions are given; here they are put on the screen.

const CASING = 1.4;
const BAND = 58; // Pixels below everything, for labels and a scale.

class Picture {
  constructor(canvas, drawing, words) {
    this.canvas = canvas;
    this.drawing = drawing;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", words);
    this.colours = new Map();
  }

  forgetColours() {
    this.colours.clear();
  }

  colour(name) {
    if (!this.colours.has(name)) this.colours.set(name, colour(name));
    return this.colours.get(name);
  }

  /** Show a sample; between two of them where `at` is no whole number. */
  draw(at) {
    const { canvas, drawing } = this;
    const ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth;
    const height = canvas.clientHeight;
    if (!width || !height) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const context = (this.context = canvas.getContext("2d"));
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    context.lineJoin = context.lineCap = "round";
    this.aim(at, width, height);
    this.points = row(drawing.points, at);
    this.bodies = row(drawing.bodies, at);
    this.active = drawing.active ? value(drawing.active, at) : null;
    this.drawGround();
    this.drawMarks(at);
    for (const contact of drawing.contacts) this.drawCone(contact, at);
    this.drawParts();
    this.drawSeen(at);
    for (const contact of drawing.contacts) this.drawForce(contact, at);
    this.drawScale();
  }

  /** The camera: x to the right, y upwards, the focus at its place. */
  aim(at, width, height) {
    const { focus, left, low, span, height: tall, follow_height: follow } = this.drawing;
    const [x, y] = row(focus, at);
    this.size = [width, height];
    this.scale = Math.min(width / span, (height - BAND) / tall);
    this.unit = Math.max(0.6, Math.min(1.3, width / 700));
    this.x0 = x - (left * width) / this.scale;
    this.y0 = (follow ? y : 0) - low - BAND / this.scale;
  }

  at(x, y) {
    return [(x - this.x0) * this.scale, this.size[1] - (y - this.y0) * this.scale];
  }

  path(points, closed = false) {
    const { context } = this;
    context.beginPath();
    points.forEach(([x, y], i) => context[i ? "lineTo" : "moveTo"](...this.at(x, y)));
    if (closed) context.closePath();
  }

  point(index) {
    return [this.points[2 * index], this.points[2 * index + 1]];
  }

  /** Parts from back to front; of those with a group the passive one first. */
  drawParts() {
    const { parts } = this.drawing;
    for (let i = 0; i < parts.length; ) {
      let end = i + 1;
      if (parts[i].group !== null) while (end < parts.length && parts[end].group !== null) end++;
      const some = parts.slice(i, end);
      const isActive = (part) => part.group === null || part.group === this.active;
      for (const part of some.filter((one) => !isActive(one))) this.drawPart(part, "pale-");
      for (const part of some.filter(isActive)) this.drawPart(part, "");
      i = end;
    }
  }

  drawPart(part, shade) {
    const { context, unit } = this;
    const fill = this.colour(shade + part.role);
    for (const [a, b] of part.bars) {
      this.path([this.point(a), this.point(b)]);
      context.lineWidth = (part.width + 2 * CASING) * unit;
      context.strokeStyle = this.colour(part.edge || "panel");
      context.stroke();
      context.lineWidth = part.width * unit;
      context.strokeStyle = fill;
      context.stroke();
    }
    for (const index of part.dots) {
      context.beginPath();
      context.arc(...this.at(...this.point(index)), (part.width / 2) * unit, 0, 2 * Math.PI);
      context.fillStyle = this.colour("page");
      context.fill();
      context.lineWidth = Math.max(1.2, part.width / 4.5) * unit;
      context.strokeStyle = fill;
      context.stroke();
    }
    if (part.outline) this.drawOutline(part, fill);
  }

  drawOutline(part, fill) {
    const { context } = this;
    const [x, y, angle] = this.bodies.slice(3 * part.body, 3 * part.body + 3);
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    const corners = [];
    for (let i = 0; i < part.outline.length; i += 2) {
      const [u, v] = [part.outline[i], part.outline[i + 1]];
      corners.push([x + c * u - s * v, y + s * u + c * v]);
    }
    this.path(corners, true);
    context.fillStyle = fill;
    context.fill();
    context.lineWidth = 1.2 * this.unit;
    context.strokeStyle = this.colour(part.edge || "panel");
    context.stroke();
  }
}
