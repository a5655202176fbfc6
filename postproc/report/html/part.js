// The part in WebGL: its surface in parallel projection, coloured by the error in halves of the tolerance; beside it
// the robot at the chosen motion, its cutter, the force, and the path of the tip.  All in the axes of the stock, mm,
// from the middle of the part.

const PROJECT = `
uniform mat3 view; uniform vec3 middle; uniform vec4 frame; uniform float far;
vec4 projected(vec3 v) { return vec4(v.x * frame.x + frame.z, v.y * frame.y + frame.w, -v.z / far, 1.0); }`;
const LIGHT = 'float light(vec3 n) { return 0.55 + 0.45 * abs(dot(n, normalize(vec3(0.3, 0.5, 0.8)))); }';
const SHADERS = {
  surface: [`#version 300 es
in vec3 place; in vec2 error; uniform vec3 extent; uniform float side; out vec3 at; out float off, known;${PROJECT}
void main() {
  at = view * ((place - 0.5) * extent - middle);
  float e = side < 0.5 ? error.x : error.y;
  known = e < -0.999 ? 0.0 : 1.0;
  off = known * e;
  gl_Position = projected(at);
}`, `#version 300 es
precision highp float;
in vec3 at; in float off, known; uniform vec3 bands[8]; uniform float unit; out vec4 ink;
${LIGHT}
void main() {
  vec3 c = known < 0.5 ? vec3(0.75) : bands[int(clamp(floor(off * unit) + 4.0, 0.0, 7.0))];
  ink = vec4(c * light(normalize(cross(dFdx(at), dFdy(at)))), 1.0);
}`],
  bodies: [`#version 300 es
in vec3 place, normal, colour; out vec3 n, c;${PROJECT}
void main() { n = view * normal; c = colour; gl_Position = projected(view * (place - middle)); }`, `#version 300 es
precision highp float;
in vec3 n, c; out vec4 ink;
${LIGHT}
void main() { ink = vec4(c * light(normalize(n)), 1.0); }`],
  path: [`#version 300 es
in vec3 place; uniform vec3 low, size; uniform float lift;${PROJECT}
void main() { vec3 v = view * (low + size * place - middle); v.z += lift; gl_Position = projected(v); }`, `#version 300 es
precision highp float;
uniform vec3 colour; out vec4 ink;
void main() { ink = vec4(colour, 1.0); }`],
};
const FORCE = [0.0, 0.62, 0.36];
const MOVING_POINTS = 40000, STRIDES = 31; // of the path while the view moves; WebGL's largest stride is 255 bytes
const INSET = 0.3;
// While the view moves and frames take longer than SLOW ms: 1 the surface by COARSE places, 2 in half the resolution.
const SLOW = 40, COARSE = 5000, LEVELS = 2;

function numbersOf(text, kind) {
  const letters = atob(text), raw = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) raw[i] = letters.charCodeAt(i);
  return kind ? new kind(raw.buffer) : raw;
}

class PartView {
  constructor(canvas, data) {
    this.canvas = canvas;
    this.data = data;
    this.scene = data.scene;
    this.side = data.sides - 1;
    this.shown = { robot: true, force: true, path: data.scene.path.all <= 20000 };
    this.gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true, alpha: true });
    if (!this.gl) return;
    this.canvas2d = { at: (event) => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; } };
    this.values = numbersOf(this.scene.joint_values, Float32Array);
    this.directions = numbersOf(this.scene.axes, Int16Array);
    this.cutters = numbersOf(this.scene.cutter);
    this.robots = this.scene.robots && numbersOf(this.scene.robots, Float32Array);
    const inside = [...Array(count).keys()].filter((i) => !inAir(i));
    this.largest = extent(quantities.force.values, inside)[1];
    this.diagonal = Math.hypot(...data.extent);
    this.share = 1;
    this.beside = 0;
    this.middle = [0, 0, 0];
    this.whole = false;
    this.cell = [[0, 0, 0], [0, 0, 0]];
    this.level = 0;
    this.coarse = [];
    if (!this.load()) { this.gl = null; return; }
    this.unpack();
    this.look('oblique');
    new ResizeObserver(() => this.later()).observe(canvas);
    darkness.addEventListener('change', () => this.later());
  }

  load() {
    const { gl } = this;
    this.programs = {};
    for (const [name, texts] of Object.entries(SHADERS)) {
      const program = gl.createProgram();
      texts.forEach((text, k) => {
        const shader = gl.createShader(k ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
        gl.shaderSource(shader, text);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
      });
      gl.linkProgram(program);
      if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return false;
      const places = new Map();
      const at = (word) => { if (!places.has(word)) places.set(word, gl.getUniformLocation(program, word)); return places.get(word); };
      this.programs[name] = { program, at, array: gl.createVertexArray(), buffer: gl.createBuffer() };
    }
    const { surface, bodies } = this.programs;
    gl.useProgram(surface.program);
    gl.bindVertexArray(surface.array);
    this.feed('surface', 'place', numbersOf(this.data.vertices), [3, gl.UNSIGNED_SHORT, true, 8, 0]);
    this.feed('surface', 'error', numbersOf(this.data.errors), [2, gl.SHORT, true, 4, 0]);
    this.faces = this.indices(numbersOf(this.data.faces, Uint32Array));
    gl.uniform3fv(surface.at('extent'), this.data.extent);
    gl.uniform3fv(surface.at('bands'), this.data.bands.flat().map((value) => value / 255));
    gl.uniform1f(surface.at('unit'), this.data.range / (0.5 * this.data.tolerance));
    gl.bindVertexArray(bodies.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, bodies.buffer);
    ['place', 'normal', 'colour'].forEach((name, k) => this.point('bodies', name, [3, gl.FLOAT, false, 4 * FLOATS, 12 * k]));
    gl.enable(gl.DEPTH_TEST);
    return true;
  }

  indices(values) {
    const { gl } = this, buffer = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, values, gl.STATIC_DRAW);
    return { buffer, count: values.length };
  }

  // The surface of a side in fewer triangles: of the places in a cell that with the largest error stands for all.
  coarser(side) {
    if (this.coarse[side]) return this.coarse[side];
    const { extent } = this.data, [a, b, c] = extent;
    const cell = Math.sqrt((2 * (a * b + b * c + c * a)) / COARSE);
    const places = numbersOf(this.data.vertices, Uint16Array), errors = numbersOf(this.data.errors, Int16Array);
    const faces = numbersOf(this.data.faces, Uint32Array), owner = new Uint32Array(places.length / 4), cells = new Map();
    const size = (i) => { const e = errors[2 * i + side]; return e < -32766 ? -1 : Math.abs(e); };
    const across = extent.map((value) => Math.floor(value / cell) + 1), keys = new Uint32Array(owner.length);
    for (let i = 0; i < owner.length; i++) {
      const [x, y, z] = [0, 1, 2].map((k) => Math.floor(((places[4 * i + k] / 65535) * extent[k]) / cell));
      keys[i] = (x * across[1] + y) * across[2] + z;
      const first = cells.get(keys[i]);
      if (first === undefined || size(i) > size(first)) cells.set(keys[i], i);
    }
    for (let i = 0; i < owner.length; i++) owner[i] = cells.get(keys[i]);
    const kept = [], seen = new Set(), many = owner.length;
    for (let f = 0; f < faces.length; f += 3) {
      const corners = [owner[faces[f]], owner[faces[f + 1]], owner[faces[f + 2]]], [i, j, k] = corners;
      if (i === j || j === k || k === i) continue;
      const [low, middle, high] = [...corners].sort((one, other) => one - other);
      const name = (low * many + middle) * many + high;
      if (seen.has(name)) continue;
      seen.add(name);
      kept.push(i, j, k);
    }
    this.coarse[side] = this.indices(new Uint32Array(kept));
    return this.coarse[side];
  }

  feed(name, attribute, raw, how) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, raw, gl.STATIC_DRAW);
    this.point(name, attribute, how);
  }

  point(name, attribute, how) {
    const { gl } = this, where = gl.getAttribLocation(this.programs[name].program, attribute);
    gl.enableVertexAttribArray(where);
    gl.vertexAttribPointer(where, ...how);
  }

  // The path: steps are added up again, modulo 65,536, and put beside each other point by point.
  async unpack() {
    const { gl } = this, { count: points, data } = this.scene.path;
    if (typeof DecompressionStream === 'undefined') return;
    const stream = new Blob([numbersOf(data)]).stream().pipeThrough(new DecompressionStream('deflate'));
    const raw = new Uint8Array(await new Response(stream).arrayBuffer()), places = new Uint16Array(4 * points);
    for (let k = 0; k < 3; k++) {
      for (let i = 0, sum = 0; i < points; i++) {
        sum = (sum + raw[2 * k * points + i] + 256 * raw[(2 * k + 1) * points + i]) & 0xffff;
        places[4 * i + k] = sum;
      }
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.programs.path.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, places, gl.STATIC_DRAW);
    this.points = points;
    this.canvas.dataset.points = points;
    this.later();
  }

  // The tip, in the axes of the stock, at share `s` of the motion to `i`.
  tip(i, s) {
    const place = (values, k) => [values[3 * k], values[3 * k + 1], values[3 * k + 2]];
    const stops = [place(motions.position, s < 1 && i > 0 ? i - 1 : i)];
    const arc = s < 1 ? motions.arc.indexOf(i) : -1;
    if (arc >= 0) for (let k = 0; k < given.each; k++) stops.push(place(motions.arc_points, arc * given.each + k));
    stops.push(place(motions.position, i));
    const at = Math.min(stops.length - 2, Math.floor(s * (stops.length - 1))), part = s * (stops.length - 1) - at;
    return placedAt(this.scene.frame, plus(stops[at], plus(stops[at + 1], stops[at], -1), part));
  }

  // A row of `values`, `wide` numbers each, between the motion before and motion `i`.
  row(values, wide, i, s) {
    const before = s < 1 && i > 0 ? i - 1 : i;
    return Array.from({ length: wide }, (_, k) => (1 - s) * values[wide * before + k] + s * values[wide * i + k]);
  }

  // Robot, cutter and arrow at the chosen motion, as bodies from the middle of the part.
  stand() {
    const { scene, share } = this, bodies = new Bodies(), arrow = new Bodies();
    const centred = ([x, y, z]) => plus([x, y, z], this.data.middle, -1);
    const tip = centred(this.tip(chosen, share));
    const axis = unit(this.row(this.directions, 3, chosen, share));
    const values = this.row(this.values, scene.columns, chosen, share);
    const base = this.robots ? this.row(this.robots, 12, chosen, share) : [...scene.robot];
    for (let k = 0; k < 3; k++) base[4 * k + 3] -= this.data.middle[k];
    this.known = values.every(Number.isFinite) && base.every(Number.isFinite);
    let flange = null;
    if (this.shown.robot && this.known) flange = drawRobot(bodies, scene, base, values);
    const cutter = scene.cutters[this.cutters[chosen]];
    if (cutter && tip.every(Number.isFinite)) drawTool(bodies, cutter, tip, axis, flange);
    const force = turnedBy(scene.frame, [0, 1, 2].map((k) => motions.force[3 * chosen + k]));
    const size = Math.hypot(...force);
    if (this.shown.force && size > 0 && !inAir(chosen) && tip.every(Number.isFinite)) {
      const long = 0.3 * this.diagonal * (0.25 + (0.75 * size) / this.largest);
      arrow.arrow(plus(tip, force, -long / size), tip, 0.008 * this.diagonal, FORCE);
    }
    this.cell = [this.data.extent.map((value) => -0.5 * value), this.data.extent.map((value) => 0.5 * value)];
    for (let i = 0; i < bodies.numbers.length; i += FLOATS) {
      for (let k = 0; k < 3; k++) {
        this.cell[0][k] = Math.min(this.cell[0][k], bodies.numbers[i + k]);
        this.cell[1][k] = Math.max(this.cell[1][k], bodies.numbers[i + k]);
      }
    }
    this.split = bodies.count;
    this.total = bodies.count + arrow.count;
    const block = new Bodies(); // in the place of the part where that is small
    block.box(this.cell[1].map((_, k) => 0.5 * this.data.extent[k]), [0.75, 0.75, 0.75]);
    this.block = block.count;
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.programs.bodies.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([...bodies.numbers, ...arrow.numbers, ...block.numbers]), gl.DYNAMIC_DRAW);
    this.stale = false;
  }

  look(name) {
    [this.yaw, this.pitch] = VIEWS[name];
    if (name === 'oblique') this.yaw = this.data.yaw;
    this.fit();
  }

  // All of the part, or with `whole` all of the robot too, in the view.
  fit() {
    this.zoom = 1;
    this.shift = [0, 0];
    this.middle = [0, 0, 0];
    this.later();
  }

  axes() {
    const [c, s, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return [[c, s, 0], [-s * sp, c * sp, cp], [s * cp, -c * cp, sp]];
  }

  // `moved`: what is beside the part changes too.
  later(moved = true) {
    this.stale ||= moved;
    if (this.waiting || !this.gl) return;
    this.waiting = true;
    requestAnimationFrame((now) => { this.waiting = false; this.watch(now); this.paint(); });
  }

  // Frames of a moving view that take too long, two in a row: from now on it moves with less detail.
  watch(now) {
    const slow = this.moving && this.before !== undefined && now - this.before > SLOW;
    this.slow = slow ? (this.slow || 0) + 1 : 0;
    if (this.slow > 1 && this.level < LEVELS) [this.level, this.slow] = [this.level + 1, 0];
    this.before = this.moving ? now : undefined;
    this.canvas.dataset.level = this.moving ? this.level : 0;
  }

  paint() {
    const { gl, canvas } = this, dense = (window.devicePixelRatio || 1) * (this.moving && this.level > 1 ? 0.5 : 1);
    this.dense = dense;
    const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
    if (!wide || !high) return;
    if (canvas.width !== Math.round(wide * dense) || canvas.height !== Math.round(high * dense)) {
      [canvas.width, canvas.height] = [Math.round(wide * dense), Math.round(high * dense)];
    }
    if (this.stale) this.stand();
    gl.clearColor(0, 0, 0, 0);
    const axes = this.axes(), half = this.data.extent.map((value) => 0.5 * value);
    const cell = this.cell[0].map((low, k) => 0.5 * (low + this.cell[1][k]));
    this.far = 2 * (this.diagonal + Math.hypot(...this.cell[0]) + Math.hypot(...this.cell[1]));
    const small = Math.round(INSET * Math.min(wide, 1.6 * high)), inset = this.shown.robot && this.known && !this.whole;
    this.beside = inset && wide > 1.5 * high ? 0.4 * small : 0; // the part is not under the small view
    const box = this.whole ? this.cell[1].map((value, k) => value - cell[k]) : half;
    this.draw([0, 0, wide, high], axes, box, this.whole ? cell : this.middle, this.zoom, plus([...this.shift, 0], [this.beside, 0, 0]));
    if (inset) {
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(0, 0, small * dense, small * dense);
      const ground = parseInt(theme().panel.slice(1), 16);
      gl.clearColor((ground >> 16) / 255, ((ground >> 8) & 255) / 255, (ground & 255) / 255, 1);
      this.draw([0, 0, small, small], axes, this.cell[1].map((value, k) => value - cell[k]), cell, 1, [0, 0], true);
      gl.disable(gl.SCISSOR_TEST);
    }
  }

  // All of it into [x, y, wide, high] of the canvas, with half of `box` and `middle` as what fills it; `small`: the
  // robot and where the part is.
  draw([x, y, wide, high], axes, box, middle, zoom, shift, small = false) {
    const { gl, dense } = this;
    gl.viewport(x * dense, y * dense, wide * dense, high * dense);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const span = axes.slice(0, 2).map((axis) => axis.reduce((sum, a, k) => sum + 2 * Math.abs(a) * box[k], 0));
    const scale = 0.92 * Math.min(wide / span[0], high / span[1]) * zoom;
    const use = (name) => {
      const { program, at, array } = this.programs[name];
      gl.useProgram(program);
      gl.bindVertexArray(array);
      gl.uniformMatrix3fv(at('view'), false, [0, 1, 2].flatMap((k) => axes.map((axis) => axis[k])));
      gl.uniform3fv(at('middle'), middle);
      gl.uniform1f(at('far'), this.far);
      gl.uniform4f(at('frame'), (2 * scale) / wide, (2 * scale) / high, (2 * shift[0]) / wide, (-2 * shift[1]) / high);
      return at;
    };
    if (!small) {
      gl.uniform1f(use('surface')('side'), this.side);
      const { buffer, count: corners } = this.moving && this.level ? this.coarser(this.side) : this.faces;
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      gl.drawElements(gl.TRIANGLES, corners, gl.UNSIGNED_INT, 0);
    }
    use('bodies');
    gl.drawArrays(gl.TRIANGLES, 0, this.split);
    if (small) return gl.drawArrays(gl.TRIANGLES, this.total, this.block);
    if (this.shown.path && this.points) this.drawPath(use('path'), scale);
    if (this.total > this.split) {
      gl.clear(gl.DEPTH_BUFFER_BIT); // the arrow is never hidden
      use('bodies');
      gl.drawArrays(gl.TRIANGLES, this.split, this.total - this.split);
    }
  }

  drawPath(at, scale) {
    const { gl } = this, { low, size } = this.scene.path;
    const every = this.moving ? Math.min(STRIDES, Math.max(1, Math.ceil(this.points / MOVING_POINTS))) : 1;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.programs.path.buffer);
    this.point('path', 'place', [3, gl.UNSIGNED_SHORT, true, 8 * every, 0]);
    gl.uniform3fv(at('low'), plus(low, this.data.middle, -1));
    gl.uniform3fv(at('size'), size);
    gl.uniform1f(at('lift'), 2 / scale);
    const ink = parseInt(theme().soft.slice(1), 16);
    gl.uniform3f(at('colour'), (ink >> 16) / 255, ((ink >> 8) & 255) / 255, (ink & 255) / 255);
    gl.drawArrays(gl.LINE_STRIP, 0, Math.floor((this.points - 1) / every) + 1);
  }

  // What the pointer and the keys do: see `listenToInput`.
  turn(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.pitch + dy));
    this.drag();
  }

  move(dx, dy) {
    this.shift = [this.shift[0] + dx, this.shift[1] + dy];
    this.drag();
  }

  drag() {
    this.moving = true;
    this.restSoon();
    this.later(false);
  }

  zoomAt(by, x, y) {
    const next = Math.min(500, Math.max(0.2, this.zoom * by)), ratio = next / this.zoom;
    const [wide, high] = this.heart();
    this.shift = [x - wide - ratio * (x - wide - this.shift[0]), y - high - ratio * (y - high - this.shift[1])];
    this.zoom = next;
    this.drag();
  }

  heart() { return [this.canvas.clientWidth / 2 + this.beside, this.canvas.clientHeight / 2]; }
  find() { return -1; }
  hover() {}

  rest() {
    this.moving = false;
    this.later(false);
  }

  restSoon() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.rest(), 180);
  }

  // The worst point of the shown side in the middle, and near.
  worst() {
    this.whole = false;
    this.shift = [0, 0];
    this.middle = this.data.worst[this.side];
    this.zoom = 4;
    this.later(false);
  }
}
