// A figure over the length of the cutting path: lines with bands, the same stretch in all charts.

const MARGIN = { left: 64, right: 18, top: 20, bottom: 34 };
const stretch = { all: [0, 1], seen: [0, 1] };

class Chart {
  // series: [{ name, values, band, colour(theme), dash, width }]; log: whether the scale is; limit: a value with a line
  // of its own.
  constructor(canvas, series, { unit, log, zero, limit }) {
    Object.assign(this, { canvas, series, unit, log, zero, limit });
    this.canvas2d = new Canvas(canvas, (pen, wide, high) => this.paint(pen, wide, high));
    this.listen();
    this.chosen();
  }

  // Rows of the stretch that is seen, cutting motions only.
  rows() {
    const [from, to] = stretch.seen, rows = [];
    let last = -1;
    for (let i = 0; i < count; i++) {
      if (inAir(i) || motions.path_length[i] < from) continue;
      if (motions.path_length[i] > to) { rows.push(i); break; }
      if (!rows.length && last >= 0) rows.push(last);
      rows.push(i);
      last = i;
    }
    return rows;
  }

  bounds(rows) {
    let low = Infinity, high = -Infinity;
    for (const { values, band } of this.series) {
      for (const i of rows) {
        const wide = band && Number.isFinite(band[i]) ? band[i] : 0, value = values[i];
        if (!Number.isFinite(value)) continue;
        if (this.log) {
          if (value > 0 && value < low) low = value;
        } else low = Math.min(low, value - wide);
        high = Math.max(high, value + wide);
      }
    }
    if (this.log) {
      if (!(high > 0)) return [1e-4, 1];
      // a few errors of next to nothing do not set the scale
      return [Math.max(low, 1e-5 * high, 1e-5) / 1.5, high * 1.4];
    }
    if (!(low <= high)) return [0, 1];
    const room = 0.06 * (high - low || 1);
    return [this.zero ? 0 : low - room, high + room];
  }

  paint(pen, wide, high) {
    const rows = this.visible = this.rows();
    const [low, most] = this.range = this.bounds(rows);
    const { left, right, top, bottom } = MARGIN;
    const [w, h] = [wide - left - right, high - top - bottom];
    const [from, to] = stretch.seen;
    this.x = (way) => left + (w * (way - from)) / (to - from || 1);
    this.y = this.log
      ? (value) => top + h * (1 - Math.log(Math.max(value, low) / low) / Math.log(most / low))
      : (value) => top + h * (1 - (value - low) / (most - low));
    this.frame(pen, left, top, w, h, low, most);
    this.cuts(pen, rows, top, h);
    pen.save();
    pen.beginPath();
    pen.rect(left, top, w, h);
    pen.clip();
    for (const one of this.series) if (one.band) this.band(pen, rows, one);
    for (const one of this.series) this.line(pen, rows, one);
    this.cursor(pen, top, h);
    if (this.limit > low && this.limit < most) this.limited(pen, left, w);
    pen.restore();
  }

  frame(pen, left, top, w, h, low, most) {
    pen.font = FONT;
    pen.lineWidth = 1;
    pen.strokeStyle = theme().faint;
    pen.fillStyle = theme().soft;
    pen.textAlign = 'right';
    for (const value of this.log ? decades(low, most) : ticks(low, most, h / 45)) {
      const y = Math.round(this.y(value)) + 0.5;
      pen.beginPath();
      pen.moveTo(left, y);
      pen.lineTo(left + w, y);
      pen.stroke();
      pen.fillText(String(value), left - 8, y + 4);
    }
    pen.textAlign = 'center';
    const long = stretch.all[1] > 10000, by = long ? 1000 : 1;
    for (const value of ticks(stretch.seen[0] / by, stretch.seen[1] / by, w / 110)) {
      const x = Math.round(this.x(value * by)) + 0.5;
      pen.beginPath();
      pen.moveTo(x, top + h);
      pen.lineTo(x, top + h + 4);
      pen.stroke();
      pen.fillText(String(value), x, top + h + 17);
    }
    pen.textAlign = 'left';
    pen.fillText(`length of the cutting path, ${long ? 'm' : 'mm'}`, left, top + h + 31);
    pen.save();
    pen.translate(13, top + h / 2);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = 'center';
    pen.fillText(this.unit, 0, 0);
    pen.restore();
    pen.strokeStyle = theme().soft;
    pen.strokeRect(left + 0.5, top + 0.5, w, h);
  }

  // Where cuts begin, with their numbers as far as there is room.
  cuts(pen, rows, top, h) {
    pen.strokeStyle = theme().soft;
    pen.fillStyle = theme().soft;
    pen.lineWidth = 1;
    pen.setLineDash([1, 3]);
    pen.textAlign = 'left';
    let free = -Infinity, lines = -Infinity;
    for (let k = 0; k < rows.length; k++) {
      if (k && motions.cut[rows[k]] === motions.cut[rows[k - 1]]) continue;
      const x = Math.round(this.x(motions.path_length[rows[k]])) + 0.5;
      if (x < MARGIN.left || x - lines < 4) continue;
      lines = x;
      pen.beginPath();
      pen.moveTo(x, top);
      pen.lineTo(x, top + h);
      pen.stroke();
      if (x > free && motions.cut[rows[k]] >= 0) {
        const text = `cut ${motions.cut[rows[k]] + 1}`;
        pen.fillText(text, x, top - 5);
        free = x + pen.measureText(text).width + 12;
      }
    }
    pen.setLineDash([]);
  }

  // Least and most of each column of points, so that no extreme is lost and no pixel is drawn twice.
  line(pen, rows, { values, colour: ink, dash, width }) {
    pen.strokeStyle = ink(theme());
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.lineJoin = 'round';
    pen.beginPath();
    let open = false, at = -1, cut = -2, low, high, last;
    const end = () => {
      if (at < 0 || low === high) return;
      pen.lineTo(at, low);
      pen.lineTo(at, high);
      pen.lineTo(at, last);
    };
    for (const i of rows) {
      if (!Number.isFinite(values[i])) { end(); open = false; at = -1; continue; }
      const x = Math.round(2 * this.x(motions.path_length[i])) / 2, y = this.y(values[i]);
      if (open && x === at && motions.cut[i] === cut) {
        low = Math.min(low, y); high = Math.max(high, y); last = y;
        continue;
      }
      end();
      if (open && motions.cut[i] === cut) pen.lineTo(x, y);
      else pen.moveTo(x, y);
      [open, at, cut, low, high, last] = [true, x, motions.cut[i], y, y, y];
    }
    end();
    pen.stroke();
    pen.setLineDash([]);
  }

  band(pen, rows, { values, band, colour: ink }) {
    pen.fillStyle = ink(theme());
    pen.globalAlpha = 0.22;
    const floor = this.range[0];
    let part = [];
    const close = () => {
      if (part.length > 1) {
        pen.beginPath();
        for (const i of part) pen.lineTo(this.x(motions.path_length[i]), this.y(values[i] + band[i]));
        for (const i of part.reverse()) pen.lineTo(this.x(motions.path_length[i]), this.y(Math.max(floor, values[i] - band[i], this.log ? floor : 0)));
        pen.fill();
      }
      part = [];
    };
    for (const i of thinned(rows, 4000)) {
      const known = Number.isFinite(values[i]) && Number.isFinite(band[i]);
      if (!known || (part.length && motions.cut[part[0]] !== motions.cut[i])) close();
      if (known) part.push(i);
    }
    close();
    pen.globalAlpha = 1;
  }

  cursor(pen, top, h) {
    const x = this.x(motions.path_length[chosen]);
    pen.strokeStyle = theme().ink;
    pen.lineWidth = 1.2;
    pen.beginPath();
    pen.moveTo(x, top);
    pen.lineTo(x, top + h);
    pen.stroke();
    for (const { values, colour: ink } of this.series) {
      if (!Number.isFinite(values[chosen])) continue;
      pen.fillStyle = ink(theme());
      pen.beginPath();
      pen.arc(x, this.y(values[chosen]), 4, 0, 2 * Math.PI);
      pen.fill();
    }
  }

  limited(pen, left, w) {
    const y = Math.round(this.y(this.limit)) + 0.5;
    pen.strokeStyle = theme().ink;
    pen.lineWidth = 1;
    pen.setLineDash([12, 3, 2, 3]);
    pen.beginPath();
    pen.moveTo(left, y);
    pen.lineTo(left + w, y);
    pen.stroke();
    pen.setLineDash([]);
    pen.textAlign = 'right';
    halo(pen, `tolerance ${this.limit} mm`, left + w - 6, y - 5, theme().ink);
  }

  // The row whose place on the path is nearest to x.
  rowAt(x) {
    const [from, to] = stretch.seen, { left, right } = MARGIN;
    const way = from + ((to - from) * (x - left)) / (this.canvas.clientWidth - left - right);
    let best = -1, least = Infinity;
    for (const i of this.visible || []) {
      const off = Math.abs(motions.path_length[i] - way);
      if (off < least) { least = off; best = i; }
    }
    return best;
  }

  listen() {
    const { canvas } = this;
    let from = null;
    canvas.addEventListener('pointerdown', (event) => {
      canvas.focus({ preventScroll: true });
      canvas.setPointerCapture(event.pointerId);
      from = [this.canvas2d.at(event)[0], [...stretch.seen], false];
    });
    canvas.addEventListener('pointermove', (event) => {
      const [x] = this.canvas2d.at(event);
      if (!from) return;
      if (Math.abs(x - from[0]) > 4) from[2] = true;
      if (!from[2]) return;
      const [low, high] = from[1], width = canvas.clientWidth - MARGIN.left - MARGIN.right;
      seen(low - ((x - from[0]) / width) * (high - low), high - ((x - from[0]) / width) * (high - low));
    });
    canvas.addEventListener('pointerup', (event) => {
      if (from && !from[2]) {
        const at = this.rowAt(this.canvas2d.at(event)[0]);
        if (at >= 0) choose(at, true);
      }
      from = null;
    });
    canvas.addEventListener('dblclick', () => seen(...stretch.all));
    canvas.addEventListener('wheel', (event) => {
      if (document.activeElement !== canvas && !event.ctrlKey) return;
      event.preventDefault();
      const at = this.rowAt(this.canvas2d.at(event)[0]);
      zoomStretch(Math.exp(event.deltaY / 400), at >= 0 ? motions.path_length[at] : motions.path_length[chosen]);
    }, { passive: false });
    canvas.addEventListener('keydown', (event) => {
      const leap = Math.max(1, Math.round(count / 50));
      const act = {
        ArrowLeft: () => choose(chosen - 1, true), ArrowRight: () => choose(chosen + 1, true),
        PageDown: () => choose(chosen + leap, true), PageUp: () => choose(chosen - leap, true),
        Home: () => choose(0, true), End: () => choose(count - 1, true),
        '+': () => zoomStretch(0.6, motions.path_length[chosen]), '=': () => zoomStretch(0.6, motions.path_length[chosen]),
        '-': () => zoomStretch(1 / 0.6, motions.path_length[chosen]), 0: () => seen(...stretch.all),
      }[event.key];
      if (!act || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      act();
    });
  }

  chosen(show) {
    const { canvas } = this, [from, to] = stretch.seen;
    canvas.setAttribute('aria-valuemin', '1');
    canvas.setAttribute('aria-valuemax', String(given.motions));
    canvas.setAttribute('aria-valuenow', String(motions.row[chosen] + 1));
    canvas.setAttribute('aria-valuetext', words(chosen).join(', '));
    const way = motions.path_length[chosen];
    if (show && (way < from || way > to)) seen(way - 0.5 * (to - from), way + 0.5 * (to - from));
    this.canvas2d.later();
  }
}

function thinned(rows, most) {
  const every = Math.ceil(rows.length / most);
  return every > 1 ? rows.filter((_, k) => k % every === 0 || k === rows.length - 1) : rows;
}

// 0.001, 0.01, ... and between them 2 and 5 where there is room.
function decades(low, high) {
  const steps = Math.log10(high / low) > 2.5 ? [1] : [1, 2, 5], found = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
    for (const step of steps) {
      const value = +(step * 10 ** power).toPrecision(3);
      if (value >= low && value <= high) found.push(value);
    }
  }
  return found;
}

// All charts show one stretch of the path.
function seen(from, to) {
  const [low, high] = stretch.all, long = Math.min(high - low, Math.max(to - from, 1e-4 * (high - low)));
  const begin = Math.min(Math.max(from, low), high - long);
  stretch.seen = [begin, begin + long];
  for (const figure of figures) if (figure instanceof Chart) figure.canvas2d.later();
}

function zoomStretch(by, about) {
  const [from, to] = stretch.seen;
  seen(about - (about - from) * by, about + (to - about) * by);
}
