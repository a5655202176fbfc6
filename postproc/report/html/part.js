// The part in WebGL: its surface in parallel projection, coloured by the error in halves of the tolerance.

const PART_VERTEX = `#version 300 es
in vec3 place; in vec2 error; uniform mat3 view; uniform vec3 middle, extent; uniform vec4 frame; uniform float side;
out vec3 at; out float off, known;
void main() {
  vec3 v = view * ((place - 0.5) * extent - middle);
  float e = side < 0.5 ? error.x : error.y;
  known = e < -0.999 ? 0.0 : 1.0;
  at = v; off = known * e;
  gl_Position = vec4(v.x * frame.x + frame.z, v.y * frame.y + frame.w, -v.z / (2.0 * length(extent)), 1.0);
}`;
const PART_FRAGMENT = `#version 300 es
precision highp float;
in vec3 at; in float off, known; uniform vec3 bands[8]; uniform float unit; out vec4 ink;
void main() {
  vec3 n = normalize(cross(dFdx(at), dFdy(at)));
  float light = 0.55 + 0.45 * abs(dot(n, normalize(vec3(0.3, 0.5, 0.8))));
  vec3 c = known < 0.5 ? vec3(0.75) : bands[int(clamp(floor(off * unit) + 4.0, 0.0, 7.0))];
  ink = vec4(c * light, 1.0);
}`;

class PartView {
  constructor(canvas, data) {
    this.canvas = canvas;
    this.data = data;
    this.side = data.sides - 1;
    this.gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true, alpha: true });
    if (!this.gl) return;
    this.sheet = { at: (event) => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; } };
    this.middle = [0, 0, 0];
    this.load();
    this.look('oblique');
    new ResizeObserver(() => this.later()).observe(canvas);
  }

  bytes(name) {
    const letters = atob(this.data[name]), raw = new Uint8Array(letters.length);
    for (let i = 0; i < letters.length; i++) raw[i] = letters.charCodeAt(i);
    return raw;
  }

  load() {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, PART_VERTEX], [gl.FRAGMENT_SHADER, PART_FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) { this.gl = null; return; }
    gl.useProgram(program);
    this.at = (name) => gl.getUniformLocation(program, name);
    const put = (target, raw) => { gl.bindBuffer(target, gl.createBuffer()); gl.bufferData(target, raw, gl.STATIC_DRAW); };
    const feed = (name, raw, size, kind, stride) => {
      put(gl.ARRAY_BUFFER, raw);
      const where = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(where);
      gl.vertexAttribPointer(where, size, kind, true, stride, 0);
    };
    feed('place', this.bytes('vertices'), 3, gl.UNSIGNED_SHORT, 8);
    feed('error', this.bytes('errors'), 2, gl.SHORT, 4);
    put(gl.ELEMENT_ARRAY_BUFFER, this.bytes('faces'));
    gl.uniform3fv(this.at('extent'), this.data.extent);
    gl.uniform3fv(this.at('bands'), this.data.bands.flat().map((value) => value / 255));
    gl.uniform1f(this.at('unit'), this.data.range / (0.5 * this.data.tolerance));
    gl.enable(gl.DEPTH_TEST);
  }

  look(name) {
    [this.yaw, this.pitch] = VIEWS[name];
    this.fit();
  }

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

  later() {
    if (this.waiting || !this.gl) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.paint(); });
  }

  paint() {
    const { gl, canvas } = this, dense = window.devicePixelRatio || 1;
    const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
    if (!wide || !high) return;
    if (canvas.width !== Math.round(wide * dense) || canvas.height !== Math.round(high * dense)) {
      [canvas.width, canvas.height] = [Math.round(wide * dense), Math.round(high * dense)];
    }
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const axes = this.axes();
    const span = axes.slice(0, 2).map((axis) => axis.reduce((sum, a, k) => sum + Math.abs(a) * this.data.extent[k], 0));
    this.scale = 0.92 * Math.min(wide / span[0], high / span[1]) * this.zoom;
    gl.uniformMatrix3fv(this.at('view'), false, [0, 1, 2].flatMap((k) => axes.map((axis) => axis[k])));
    gl.uniform3fv(this.at('middle'), this.middle);
    gl.uniform4f(this.at('frame'), (2 * this.scale) / wide, (2 * this.scale) / high, (2 * this.shift[0]) / wide, (-2 * this.shift[1]) / high);
    gl.uniform1f(this.at('side'), this.side);
    gl.drawElements(gl.TRIANGLES, this.data.corners, gl.UNSIGNED_INT, 0);
  }

  // What the pointer and the keys do: see `hands`.
  turn(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.pitch + dy));
    this.later();
  }

  move(dx, dy) {
    this.shift = [this.shift[0] + dx, this.shift[1] + dy];
    this.later();
  }

  zoomAt(by, x, y) {
    const next = Math.min(500, Math.max(0.2, this.zoom * by)), ratio = next / this.zoom;
    const [wide, high] = [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2];
    this.shift = [x - wide - ratio * (x - wide - this.shift[0]), y - high - ratio * (y - high - this.shift[1])];
    this.zoom = next;
    this.later();
  }

  heart() { return [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2]; }
  find() { return -1; }
  hover() {}
  rest() {}
  restSoon() {}

  // The worst point of the shown side in the middle, and near.
  worst() {
    this.shift = [0, 0];
    this.middle = this.data.worst[this.side];
    this.zoom = 4;
    this.later();
  }
}

function showPart() {
  const place = document.getElementById('part-data');
  if (!place) return;
  const live = document.getElementById('part-live');
  live.hidden = false;
  const view = new PartView(document.getElementById('part'), JSON.parse(place.textContent));
  if (!view.gl) { live.hidden = true; return; }
  document.getElementById('part-static').hidden = true;
  hands(view);
  const side = document.getElementById('part-side');
  side.addEventListener('input', () => { view.side = Math.min(+side.value, view.data.sides - 1); view.later(); });
  for (const button of document.querySelectorAll('[data-part-view]')) {
    button.addEventListener('click', () => view.look(button.dataset.partView));
  }
  document.getElementById('part-worst').addEventListener('click', () => view.worst());
  addEventListener('beforeprint', () => view.paint());
}

showPart();
