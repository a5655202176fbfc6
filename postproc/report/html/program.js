// The page of one program: its figures, and what moves them.

const byId = (id) => document.getElementById(id);

function start() {
  if (!count) return;
  const whole = extent(motions.path_length);
  stretch.all = [whole[0], Math.max(whole[1], whole[0] + 1e-3)];
  stretch.seen = [...stretch.all];
  if (given.places.length) chosen = nearest(motions.row, given.places[0]);

  const view = new View3D(byId('view3d'), byId('marks'), byId('tip'));
  listenToInput(view);
  figures.push(view);
  const errors = [{ name: 'before', values: motions.before, band: motions.before_width, colour: (t) => t.before, dash: [7, 4], width: 1.7 }];
  if (given.corrected) {
    errors.push({ name: 'after', values: motions.after, band: motions.after_width, colour: (t) => t.after, dash: [], width: 1.7 });
    if (motions.path_error.some(Number.isFinite)) {
      errors.push({ name: 'path error between points', values: motions.path_error, colour: (t) => t.soft, dash: [2, 2], width: 1.2 });
    }
  }
  const error = new Chart(byId('error'), errors, { unit: given.corrected ? 'error, mm (logarithmic)' : 'error, mm', log: given.corrected, zero: true, limit: given.tolerance });
  byId('linear').checked = !given.corrected;
  figures.push(error);
  legend(byId('error-legend'), errors);
  if (given.corrected) {
    const axes = ['X', 'Y', 'Z'].map((name, k) => ({
      name, values: motions.correction.filter((_, i) => i % 3 === k), colour: (t) => t.axes[k],
      dash: [[], [8, 4], [2, 3]][k], width: 1.6,
    }));
    figures.push(new Chart(byId('correction'), axes, { unit: 'correction, mm', log: false, zero: false }));
    legend(byId('correction-legend'), axes);
  }
  bar(view, error);
  figures.push(readout());
  choose(chosen, false);
  addEventListener('beforeprint', () => print(true));
  addEventListener('afterprint', () => print(false));
}

function print(on) {
  printing = on;
  for (const figure of figures) if (figure.canvas2d) figure.canvas2d.now();
  for (const figure of figures) if (figure.inked) figure.inked();
}

// What the lines of a chart are: each with a piece of itself.
function legend(place, series) {
  const inked = () => {
    place.replaceChildren(...series.map(({ name, colour: ink, dash, width }) => {
      const sample = document.createElement('canvas');
      sample.width = 68;
      sample.height = 20;
      Object.assign(sample.style, { width: '34px', height: '10px', border: '0' });
      const pen = sample.getContext('2d');
      pen.scale(2, 2);
      pen.strokeStyle = ink(theme());
      pen.lineWidth = width + 0.4;
      pen.setLineDash(dash);
      pen.moveTo(0, 5);
      pen.lineTo(34, 5);
      pen.stroke();
      const item = document.createElement('i');
      item.append(sample, name);
      return item;
    }));
  };
  inked();
  darkness.addEventListener('change', inked);
  figures.push({ chosen() {}, inked });
}

function bar(view, error) {
  byId('quantity').addEventListener('change', (event) => { view.quantity = event.target.value; view.canvas2d.later(); });
  for (const name of ['arrows', 'deflected']) {
    byId(name).addEventListener('change', (event) => { view[name] = event.target.checked; view.canvas2d.later(); });
  }
  // from once to ten thousand times; at first the largest deflection is a tenth of the part
  const slider = byId('magnify'), largest = extent(lengths(motions.deflection), view.inside)[1];
  const magnify = () => {
    const raw = 10 ** (slider.value / 25), size = 10 ** Math.floor(Math.log10(raw));
    view.magnify = Math.round(raw / size) * size;
    byId('magnified').textContent = `${view.magnify} ×`;
    view.canvas2d.later();
  };
  slider.value = largest > 0 ? 25 * Math.log10(Math.max(1, (0.1 * view.size) / largest)) : 0;
  slider.addEventListener('input', magnify);
  magnify();
  for (const button of document.querySelectorAll('[data-view]')) {
    button.addEventListener('click', () => view.look(button.dataset.view));
  }
  for (const button of document.querySelectorAll('[data-zoom]')) {
    const by = { in: 0.6, out: 1 / 0.6 }[button.dataset.zoom];
    button.addEventListener('click', () => (by ? zoomStretch(by, motions.path_length[chosen]) : seen(...stretch.all)));
  }
  byId('linear').addEventListener('change', (event) => {
    error.log = !event.target.checked;
    error.unit = error.log ? 'error, mm (logarithmic)' : 'error, mm';
    error.canvas2d.later();
  });
  const goTo = (i) => {
    choose(i, true);
    view.approach();
    byId('h-path').scrollIntoView({ block: 'start' });
    byId('view3d').focus({ preventScroll: true });
  };
  for (const button of document.querySelectorAll('[data-row]')) {
    button.addEventListener('click', () => goTo(nearest(motions.row, +button.dataset.row)));
  }
  for (const button of document.querySelectorAll('[data-line]')) {
    button.addEventListener('click', () => goTo(nearest(motions.line, +button.dataset.line)));
  }
  const worst = byId('worst');
  worst.disabled = !given.places.length;
  worst.addEventListener('click', () => choose(nearest(motions.row, given.places[0]), true));
}

// The chosen motion in words, and the controls that choose it.
function readout() {
  const [slider, line, said] = [byId('motion'), byId('line'), byId('readout')];
  slider.max = count - 1;
  line.max = extent(motions.line)[1];
  slider.addEventListener('input', () => choose(+slider.value, true));
  line.addEventListener('change', () => choose(nearest(motions.line, +line.value), true));
  return {
    chosen() {
      slider.value = chosen;
      line.value = motions.line[chosen];
      const description = words(chosen);
      slider.setAttribute('aria-valuetext', description[0]);
      said.textContent = description.join(' · ');
      const link = byId('in-program');
      if (link) {
        link.href = `#L${motions.line[chosen]}`;
        link.hidden = !listed(motions.line[chosen]);
      }
    },
  };
}

start();
