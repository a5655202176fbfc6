// The 3-D view: the wanted path in the robot base, seen in parallel projection.  Colour and width of a motion say the
// chosen quantity; a thin line beside it is the deflected path, magnified.

// Turn about Z and tilt: the front is seen from +X, the side from -Y.
const VIEWS = { oblique: [0.6, 0.6], top: [0, Math.PI / 2], front: [Math.PI / 2, 0], side: [0, 0] };

const BINS = 24, SLABS = 24, NEAR = 16, WHILE_MOVING = 15000, ARROWS = 90, CLOSE = 4;

class View3D {
  // marks: a clear canvas above the other, for what changes while the view stays.
  constructor(canvas, marks, tip) {
    this.canvas2d = new Canvas(canvas, (pen, wide, high) => this.paint(pen, wide, high));
    this.above = new Canvas(marks, (pen) => this.marks(pen), true);
    this.canvas = canvas;
    this.tip = tip;
    this.quantity = 'before';
    this.arrows = true;
    this.deflected = false;
    this.magnify = 0;
    this.hovered = -1;
    this.moving = false;
    this.screen = new Float32Array(2 * count);
    this.depth = new Float32Array(count);
    this.known = new Uint8Array(count);
    this.inside = [];
    this.arcs = new Map();
    motions.arc.forEach((i, k) => this.arcs.set(i, k * given.each));
    this.curve = new Float32Array(2 * (motions.arc_points.length / 3));
    for (let i = 0; i < count; i++) {
      this.known[i] = Number.isFinite(motions.position[3 * i]) ? 1 : 0;
      if (!inAir(i)) this.inside.push(i);
    }
    this.measure();
    this.look('oblique');
  }

  // The box of the cutting motions (of all, where none cuts): what the view turns about and shows whole.
  measure() {
    this.low = [Infinity, Infinity, Infinity];
    this.high = [-Infinity, -Infinity, -Infinity];
    for (const cuttingOnly of [true, false]) {
      for (let i = 0; i < count; i++) {
        if (!this.known[i] || (cuttingOnly && inAir(i))) continue;
        for (let k = 0; k < 3; k++) {
          const value = motions.position[3 * i + k];
          this.low[k] = Math.min(this.low[k], value);
          this.high[k] = Math.max(this.high[k], value);
        }
      }
      if (this.low[0] <= this.high[0]) break;
    }
    motions.arc_points.forEach((value, at) => {
      this.low[at % 3] = Math.min(this.low[at % 3], value);
      this.high[at % 3] = Math.max(this.high[at % 3], value);
    });
    if (!(this.low[0] <= this.high[0])) { this.low = [0, 0, 0]; this.high = [1, 1, 1]; }
    this.middle = this.low.map((low, k) => 0.5 * (low + this.high[k]));
    this.size = Math.max(1, Math.hypot(...this.low.map((low, k) => this.high[k] - low)));
  }

  look(name) {
    [this.yaw, this.pitch] = VIEWS[name];
    this.fit();
  }

  fit() {
    this.zoom = 1;
    this.shift = [0, 0];
    this.canvas2d.later();
  }

  // Unit vectors to the right, up, and towards the reader.
  axes() {
    const [c, s, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return [[c, s, 0], [-s * sp, c * sp, cp], [s * cp, -c * cp, sp]];
  }

  project(wide, high) {
    this.wide = wide;
    const [right, up, out] = this.axes();
    // as large as the turned box allows
    const spans = [right, up].map((axis) => axis.reduce((sum, a, k) => sum + Math.abs(a) * (this.high[k] - this.low[k]), 0));
    const whole = Math.min((wide - 110) / Math.max(spans[0], 1e-6), (high - 110) / Math.max(spans[1], 1e-6));
    this.scale = Math.min(whole, 1e4) * this.zoom;
    const [mx, my, mz] = this.middle;
    this.centre = [wide / 2 + this.shift[0], high / 2 + this.shift[1]];
    const p = motions.position;
    for (let i = 0; i < count; i++) {
      const x = p[3 * i] - mx, y = p[3 * i + 1] - my, z = p[3 * i + 2] - mz;
      this.screen[2 * i] = this.centre[0] + this.scale * (right[0] * x + right[1] * y + right[2] * z);
      this.screen[2 * i + 1] = this.centre[1] - this.scale * (up[0] * x + up[1] * y + up[2] * z);
      this.depth[i] = out[0] * x + out[1] * y + out[2] * z;
    }
    this.right = right;
    this.up = up;
    for (let k = 0; k < this.curve.length / 2; k++) {
      [this.curve[2 * k], this.curve[2 * k + 1]] = this.spot([0, 1, 2].map((axis) => motions.arc_points[3 * k + axis]));
    }
  }

  // From the motion before to this one; an arc goes by the points on it.
  segment(pen, i, stride) {
    pen.moveTo(this.screen[2 * (i - stride)], this.screen[2 * (i - stride) + 1]);
    const first = stride === 1 ? this.arcs.get(i) : undefined;
    if (first !== undefined) {
      for (let k = first; k < first + given.each; k++) pen.lineTo(this.curve[2 * k], this.curve[2 * k + 1]);
    }
    pen.lineTo(this.screen[2 * i], this.screen[2 * i + 1]);
  }

  spot(place) {
    const at = place.map((value, k) => value - this.middle[k]);
    const dot = (axis) => axis.reduce((sum, a, k) => sum + a * at[k], 0);
    return [this.centre[0] + this.scale * dot(this.right), this.centre[1] - this.scale * dot(this.up)];
  }

  along(vectors, i, by) {
    const [x, y, z] = [vectors[3 * i], vectors[3 * i + 1], vectors[3 * i + 2]];
    return [by * (this.right[0] * x + this.right[1] * y + this.right[2] * z),
      -by * (this.up[0] * x + this.up[1] * y + this.up[2] * z)];
  }

  paint(pen, wide, high) {
    this.project(wide, high);
    const { values } = quantities[this.quantity];
    this.range = extent(values, this.inside);
    if (this.range[0] > 0 && this.range[0] < 0.5 * this.range[1]) this.range[0] = 0;
    // what is to be within the tolerance is shown in quarters of it: a small residual does not look like a large one
    this.bands = quantities[this.quantity].bands && given.tolerance > 0 ? 8 : 0;
    if (this.bands) this.range = [0, 2 * given.tolerance];
    this.box(pen);
    const stride = this.moving ? Math.ceil(count / WHILE_MOVING) : 1;
    this.air(pen, stride);
    this.path(pen, values, stride);
    if (this.deflected) this.deflectedPath(pen, stride, wide, high);
    if (this.arrows) this.forces(pen, wide);
    this.sizes(pen);
    this.triad(pen, high);
    this.key(pen, wide, high);
    if (printing) this.marks(pen); // a printer lays the canvas of the marks over this one
    else this.above.now();
  }

  corner(bits) {
    return this.spot([0, 1, 2].map((k) => ((bits >> k) & 1 ? this.high[k] : this.low[k])));
  }

  // The edges of the box.
  box(pen) {
    pen.strokeStyle = theme().faint;
    pen.lineWidth = 0.8;
    pen.beginPath();
    for (let bits = 0; bits < 8; bits++) {
      for (let k = 0; k < 3; k++) {
        if ((bits >> k) & 1) continue;
        pen.moveTo(...this.corner(bits));
        pen.lineTo(...this.corner(bits | (1 << k)));
      }
    }
    pen.stroke();
  }

  // Its lengths.
  sizes(pen) {
    pen.font = FONT;
    pen.textAlign = 'center';
    for (let k = 0; k < 3; k++) {
      const [from, to] = [this.corner(0), this.corner(1 << k)];
      const length = this.high[k] - this.low[k];
      if (Math.hypot(to[0] - from[0], to[1] - from[1]) < 50 || length < 1e-3) continue;
      const text = `${'XYZ'[k]} ${length.toFixed(length < 10 ? 1 : 0)} mm`;
      halo(pen, text, 0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1]) + 16, theme().soft);
    }
  }

  air(pen, stride) {
    pen.strokeStyle = theme().soft;
    pen.lineWidth = 0.7;
    pen.setLineDash([2, 4]);
    pen.beginPath();
    for (let i = stride; i < count; i += stride) {
      if (!inAir(i) || !this.known[i] || !this.known[i - stride]) continue;
      this.segment(pen, i, stride);
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  // The middle of the band that a share of the scale lies in; what is above the scale is in the last one.
  banded(share) {
    if (!this.bands || !Number.isFinite(share)) return share;
    return (Math.min(this.bands - 1, Math.floor(share * this.bands)) + 0.5) / this.bands;
  }

  // Segments by depth and value: far ones first, those of one slab and one value in one stroke.
  path(pen, values, stride) {
    const [low, high] = this.range, span = high - low || 1;
    let [near, far] = [-Infinity, Infinity];
    for (let i = 0; i < count; i++) {
      if (!this.known[i] || inAir(i)) continue;
      if (this.depth[i] > near) near = this.depth[i];
      if (this.depth[i] < far) far = this.depth[i];
    }
    const thick = near - far || 1;
    const heaps = new Array(SLABS * (BINS + 1));
    for (let i = stride; i < count; i += stride) {
      if (inAir(i) || !this.known[i] || !this.known[i - stride]) continue;
      const slab = Math.min(SLABS - 1, Math.max(0, Math.floor((SLABS * (this.depth[i] - far)) / thick)));
      const share = this.banded((values[i] - low) / span);
      // motions that were not corrected, or are not known, have a heap of their own
      const plain = !Number.isFinite(share) || (given.corrected && motions.state[i] !== CORRECTED);
      const bin = plain ? BINS : Math.min(BINS - 1, Math.max(0, Math.floor(BINS * share)));
      (heaps[slab * (BINS + 1) + bin] ||= []).push(i);
    }
    const colours = Array.from({ length: BINS }, (_, bin) => colour((bin + 0.5) / BINS));
    pen.lineCap = 'round';
    for (let heap = 0; heap < heaps.length; heap++) {
      if (!heaps[heap]) continue;
      const bin = heap % (BINS + 1), plain = bin === BINS;
      pen.strokeStyle = plain ? theme().ink : colours[bin];
      pen.lineWidth = plain ? 1.4 : 1.3 + (2.7 * bin) / BINS;
      pen.setLineDash(plain ? [6, 4] : []);
      pen.beginPath();
      for (const i of heaps[heap]) this.segment(pen, i, stride);
      pen.stroke();
    }
    pen.setLineDash([]);
  }

  deflectedPath(pen, stride, wide, high) {
    const by = this.magnify * this.scale;
    pen.strokeStyle = theme().before;
    pen.lineWidth = 0.9;
    pen.beginPath();
    let open = false;
    for (let i = 0; i < count; i += stride) {
      const known = this.known[i] && !inAir(i) && Number.isFinite(motions.deflection[3 * i]);
      if (known) {
        const [x, y] = this.along(motions.deflection, i, by);
        if (open) pen.lineTo(this.screen[2 * i] + x, this.screen[2 * i + 1] + y);
        else pen.moveTo(this.screen[2 * i] + x, this.screen[2 * i + 1] + y);
      }
      open = known;
    }
    pen.stroke();
    pen.font = FONT;
    pen.textAlign = 'right';
    halo(pen, `thin line: the deflected path, ${this.magnify} ×`, wide - 12, high - 14, theme().before);
  }

  // Some motions with their force, as long as it is large; the arrow ends where the force acts.
  forces(pen, wide) {
    const rows = this.inside, every = Math.max(1, Math.ceil(rows.length / ARROWS));
    const largest = extent(quantities.force.values, rows)[1];
    if (!(largest > 0)) return;
    pen.strokeStyle = pen.fillStyle = theme().ink;
    pen.lineWidth = 1;
    pen.globalAlpha = 0.75;
    for (let k = every >> 1; k < rows.length; k += every) {
      const i = rows[k];
      if (!this.known[i]) continue;
      const [x, y] = [this.screen[2 * i], this.screen[2 * i + 1]];
      const [dx, dy] = this.along(motions.force, i, Math.min(46, wide / 16) / largest);
      const long = Math.hypot(dx, dy);
      if (!(long > 3)) continue;
      const [ux, uy] = [dx / long, dy / long];
      pen.beginPath();
      pen.moveTo(x - dx, y - dy);
      pen.lineTo(x, y);
      pen.stroke();
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(x - 6 * ux + 2.5 * uy, y - 6 * uy - 2.5 * ux);
      pen.lineTo(x - 6 * ux - 2.5 * uy, y - 6 * uy + 2.5 * ux);
      pen.fill();
    }
    pen.globalAlpha = 1;
  }

  // The worst place (triangle) and the chosen motion (ring), with their lines.
  marks(pen) {
    if (!this.right) return;
    pen.font = `bold ${FONT}`;
    pen.textAlign = 'left';
    const worst = given.places.length ? nearest(motions.row, given.places[0]) : -1;
    if (worst >= 0 && this.known[worst]) {
      const [x, y] = [this.screen[2 * worst], this.screen[2 * worst + 1]];
      pen.beginPath();
      pen.moveTo(x, y - 3);
      pen.lineTo(x - 6, y - 14);
      pen.lineTo(x + 6, y - 14);
      pen.closePath();
      pen.lineWidth = 2;
      pen.strokeStyle = theme().ground;
      pen.stroke();
      pen.fillStyle = theme().ink;
      pen.fill();
      const right = x + 130 > this.wide;
      pen.textAlign = right ? 'right' : 'left';
      halo(pen, `worst, line ${motions.line[worst]}`, x + (right ? -10 : 10), y - 10, theme().ink);
      pen.textAlign = 'left';
    }
    for (const [i, text] of [[chosen, chosen === worst ? '' : `line ${motions.line[chosen]}`], [this.hovered, '']]) {
      if (i < 0 || !this.known[i]) continue;
      const [x, y] = [this.screen[2 * i], this.screen[2 * i + 1]];
      for (const [width, ink] of [[5, theme().ground], [2, theme().ink]]) {
        pen.lineWidth = width;
        pen.strokeStyle = ink;
        pen.beginPath();
        pen.arc(x, y, 7, 0, 2 * Math.PI);
        pen.stroke();
      }
      if (text) halo(pen, text, x + 12, y + 16, theme().ink);
    }
  }

  triad(pen, high) {
    const [x, y] = [44, high - 44];
    pen.lineWidth = 1.6;
    pen.font = FONT;
    pen.textAlign = 'center';
    for (let k = 0; k < 3; k++) {
      const [dx, dy] = [28 * this.right[k], -28 * this.up[k]];
      pen.strokeStyle = pen.fillStyle = theme().ink;
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(x + dx, y + dy);
      pen.stroke();
      pen.fillText('XYZ'[k], x + 1.32 * dx, y + 1.32 * dy + 4);
    }
  }

  // The scale of colour and width, with its numbers.
  key(pen, wide, high) {
    const { title, unit, decimals } = quantities[this.quantity];
    const [low, most] = this.range, [x, top, tall] = [wide - 26, 40, Math.min(200, high - 120)];
    pen.font = FONT;
    pen.textAlign = 'right';
    pen.fillStyle = theme().ink;
    pen.fillText(`${title}, ${unit}`, wide - 12, 22);
    for (let k = 0; k < BINS; k++) {
      const half = 2 + (8 * k) / BINS;
      pen.fillStyle = colour(this.banded((k + 0.5) / BINS));
      pen.fillRect(x - half, top + tall * (1 - (k + 1) / BINS), 2 * half, tall / BINS + 0.6);
    }
    pen.fillStyle = theme().soft;
    for (const value of this.bands ? [0, 0.5 * most, most] : ticks(low, most, 4)) {
      const share = most > low ? (value - low) / (most - low) : 0;
      const name = !this.bands || !value ? number(value, decimals) : value < most ? 'tolerance' : '2 × tolerance or more';
      pen.fillText(name, x - 16, top + tall * (1 - share) + 4);
    }
  }

  turn(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.pitch + dy));
    this.moving = true;
    this.canvas2d.later();
  }

  move(dx, dy) {
    this.shift = [this.shift[0] + dx, this.shift[1] + dy];
    this.moving = true;
    this.canvas2d.later();
  }

  zoomAt(by, x, y) {
    const next = Math.min(2000, Math.max(0.2, this.zoom * by)), ratio = next / this.zoom;
    const [wide, high] = [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2];
    this.shift = [x - wide - ratio * (x - wide - this.shift[0]), y - high - ratio * (y - high - this.shift[1])];
    this.zoom = next;
    this.moving = true;
    this.canvas2d.later();
  }

  rest() {
    this.moving = false;
    this.canvas2d.later();
  }

  restSoon() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.rest(), 180);
  }

  find(x, y) {
    let best = -1, least = NEAR * NEAR;
    for (let i = 0; i < count; i++) {
      if (!this.known[i]) continue;
      const dx = this.screen[2 * i] - x, dy = this.screen[2 * i + 1] - y, off = dx * dx + dy * dy;
      if (off < least) { least = off; best = i; }
    }
    return best;
  }

  hover(x, y) {
    const at = this.find(x, y);
    if (at === this.hovered) return;
    this.hovered = at;
    this.tip.hidden = at < 0;
    if (at >= 0) {
      this.tip.textContent = words(at).join('\n');
      const { clientWidth: wide, clientHeight: high } = this.canvas;
      const [sx, sy] = [this.screen[2 * at], this.screen[2 * at + 1]];
      this.tip.style.left = `${Math.max(0, Math.min(sx + 16, wide - this.tip.offsetWidth - 4))}px`;
      this.tip.style.top = `${Math.max(0, Math.min(sy + 16, high - this.tip.offsetHeight - 4))}px`;
    }
    this.above.later();
  }

  // Where the keys zoom to: the chosen motion.
  heart() {
    return this.known[chosen] ? [this.screen[2 * chosen], this.screen[2 * chosen + 1]] : this.centre;
  }

  // The chosen motion in the middle, and near.
  approach() {
    if (!this.known[chosen]) return;
    this.zoomAt(Math.max(1, CLOSE / this.zoom), ...this.heart());
    this.project(this.canvas.clientWidth, this.canvas.clientHeight);
    const [x, y] = this.heart();
    this.move(this.canvas.clientWidth / 2 - x, this.canvas.clientHeight / 2 - y);
    this.rest();
  }

  // Another motion was chosen; `show`: bring it into the view.
  chosen(show) {
    if (show && this.known[chosen] && this.right) {
      const { clientWidth: wide, clientHeight: high } = this.canvas;
      const [x, y] = this.spot([0, 1, 2].map((k) => motions.position[3 * chosen + k]));
      if (x < 30 || y < 30 || x > wide - 30 || y > high - 30) {
        this.move(wide / 2 - x, high / 2 - y);
        this.rest();
      }
    }
    this.above.later();
  }
}
