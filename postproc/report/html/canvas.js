// What all figures share: the columns of the motions, colours, numbers in words, the motion that is chosen.

const given = JSON.parse(document.getElementById('data').textContent);
const count = given.count;
const AIR = 0, CORRECTED = 1, LEAD_IN = 4;
const inAir = (i) => motions.state[i] === AIR || motions.state[i] === LEAD_IN;

function column(name) {
  const { form, wide, base64 } = given.columns[name];
  const letters = atob(base64);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  const kind = { f4: Float32Array, i4: Int32Array, u1: Uint8Array }[form];
  const values = new kind(bytes.buffer);
  values.wide = wide;
  return values;
}

const motions = {};
for (const name of Object.keys(given.columns)) motions[name] = column(name);

function lengths(vectors) {
  const sizes = new Float32Array(count);
  for (let i = 0; i < count; i++) sizes[i] = Math.hypot(vectors[3 * i], vectors[3 * i + 1], vectors[3 * i + 2]);
  return sizes;
}

// Quantities that colour the path: values by motion, and how many decimals people read.
const quantities = {
  before: { title: 'error before', unit: 'mm', decimals: 3, values: motions.before },
  after: { title: 'error after', unit: 'mm', decimals: 4, values: motions.after, bands: true },
  path_error: { title: 'path error between points', unit: 'mm', decimals: 4, values: motions.path_error, bands: true },
  correction: { title: 'correction', unit: 'mm', decimals: 3, values: lengths(motions.correction) },
  force: { title: given.force_word, unit: 'N', decimals: 0, values: lengths(motions.force) },
};

function extent(values, rows) {
  let low = Infinity, high = -Infinity;
  const n = rows ? rows.length : values.length;
  for (let k = 0; k < n; k++) {
    const value = values[rows ? rows[k] : k];
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : [0, 0];
}

// Colours. Viridis rises evenly in lightness, so it is read without telling red from green; its end that would vanish
// against the ground is left out, and the large values stand out most.  Before is orange and dashed, after is blue
// and full (Okabe and Ito).
const VIRIDIS = ['#440154', '#482475', '#414487', '#355f8d', '#2a788e', '#21918c', '#22a884', '#44bf70', '#7ad151',
  '#bddf26', '#fde725'];
const THEMES = {
  light: { ground: '#ffffff', ink: '#16181d', soft: '#565c68', faint: '#c3c8d1', panel: '#f1f3f6',
    scale: [0.86, 0.0], before: '#b34700', after: '#00539b', axes: ['#b34700', '#00539b', '#5b5b5b'] },
  dark: { ground: '#14161a', ink: '#e9ebef', soft: '#a8afbc', faint: '#4a505c', panel: '#1d2026',
    scale: [0.24, 1.0], before: '#f0a35a', after: '#6cb8ff', axes: ['#f0a35a', '#6cb8ff', '#c8c8c8'] },
};
const darkness = matchMedia('(prefers-color-scheme: dark)');
let printing = false;
const theme = () => THEMES[darkness.matches && !printing ? 'dark' : 'light'];

function colour(share) {
  const [low, high] = theme().scale;
  const at = (low + (high - low) * Math.min(1, Math.max(0, share))) * (VIRIDIS.length - 1);
  const k = Math.min(VIRIDIS.length - 2, Math.floor(at)), part = at - k;
  const mixed = [1, 3, 5].map((i) => {
    const [a, b] = [VIRIDIS[k], VIRIDIS[k + 1]].map((text) => parseInt(text.slice(i, i + 2), 16));
    return Math.round(a + (b - a) * part);
  });
  return `rgb(${mixed.join(',')})`;
}

// Round numbers between two ends, about `wanted` of them.
function ticks(low, high, wanted) {
  if (!(high > low)) return [low];
  const raw = (high - low) / Math.max(1, wanted), size = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].find((one) => one * size >= raw) * size;
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(+(k * step).toPrecision(12));
  return found;
}

function number(value, decimals) {
  return Number.isFinite(value) ? value.toFixed(decimals) : 'not known';
}

function vector(values, i, decimals) {
  return [0, 1, 2].map((k) => number(values[3 * i + k], decimals)).join(', ');
}

// A motion in words, a line each figure.
function words(i) {
  const cut = motions.cut[i] >= 0 ? `, cut ${motions.cut[i] + 1}` : '';
  const description = [`line ${motions.line[i]}: ${given.kinds[motions.kind[i]]}${cut}, ${given.states[motions.state[i]]}`];
  description.push(`at ${vector(motions.position, i, 2)} mm`);
  if (inAir(i)) return description;
  const wide = (widths) => (Number.isFinite(widths[i]) ? ` ± ${number(widths[i], 3)}` : '');
  description.push(`error before ${number(motions.before[i], 3)}${wide(motions.before_width)} mm`);
  if (given.corrected) {
    description.push(`correction X Y Z ${vector(motions.correction, i, 3)} mm`);
    const between = Number.isFinite(motions.path_error[i]) ? `, path error between points ${number(motions.path_error[i], 4)} mm` : '';
    description.push(`error after ${number(motions.after[i], 4)}${wide(motions.after_width)} mm${between}`);
    if (motions.inserted[i]) description.push(`${motions.inserted[i]} inserted before it`);
  }
  description.push(`${given.force_word} ${number(quantities.force.values[i], 0)} N (${vector(motions.force, i, 0)})`);
  return description;
}

// The motion that all figures mark; `figures` are informed when it changes.
const figures = [];
let chosen = 0;

function choose(i, show) {
  chosen = Math.min(count - 1, Math.max(0, i));
  for (const figure of figures) figure.chosen(show);
}

function nearest(values, wanted) {
  let best = 0, least = Infinity;
  for (let i = 0; i < count; i++) {
    const off = Math.abs(values[i] - wanted);
    if (off < least) { least = off; best = i; }
  }
  return best;
}

// Text that can be read above lines.
function halo(pen, text, x, y, ink) {
  pen.lineWidth = 4;
  pen.strokeStyle = theme().ground;
  pen.strokeText(text, x, y);
  pen.fillStyle = ink;
  pen.fillText(text, x, y);
}

// A canvas as sharp as the screen, drawn once a frame at most.
class Canvas {
  constructor(canvas, draw, clear = false) {
    this.canvas = canvas;
    this.clear = clear;
    this.pen = canvas.getContext('2d');
    this.draw = draw;
    this.waiting = false;
    new ResizeObserver(() => this.later()).observe(canvas);
    darkness.addEventListener('change', () => this.later());
  }

  later() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.now(); });
  }

  now() {
    const sharp = Math.max(window.devicePixelRatio || 1, printing ? 2 : 1);
    const { clientWidth: wide, clientHeight: high } = this.canvas;
    if (!wide || !high) return;
    const [w, h] = [Math.round(wide * sharp), Math.round(high * sharp)];
    if (this.canvas.width !== w) this.canvas.width = w;
    if (this.canvas.height !== h) this.canvas.height = h;
    this.pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    this.pen.clearRect(0, 0, wide, high);
    if (!this.clear) {
      this.pen.fillStyle = theme().ground;
      this.pen.fillRect(0, 0, wide, high);
    }
    this.draw(this.pen, wide, high);
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left - this.canvas.clientLeft, event.clientY - box.top - this.canvas.clientTop];
  }
}
const FONT = '12px system-ui, "Segoe UI", "DejaVu Sans", Arial, sans-serif';
