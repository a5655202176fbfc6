// The controls of the part's view: what is shown, before and after, and playing along the path.

const LONGEST = 40; // s: of the path at the speed that is set first

class Playback {
  constructor(view) {
    this.view = view;
    this.length = new Float64Array(count); // mm, from the first motion to the end of each
    for (let i = 1; i < count; i++) {
      const step = Math.hypot(...[0, 1, 2].map((k) => motions.position[3 * i + k] - motions.position[3 * (i - 1) + k]));
      this.length[i] = this.length[i - 1] + (Number.isFinite(step) ? step : 0);
    }
    this.speed = 10 ** Math.min(4, Math.max(0, Math.log10((this.length[count - 1] || 1) / LONGEST)));
  }

  get playing() { return this.frame !== undefined; }

  toggle() {
    if (this.playing) return this.stop();
    if (chosen >= count - 1 && this.view.share >= 1) { choose(0, false); }
    const before = chosen > 0 ? this.length[chosen - 1] : 0;
    this.at = before + this.view.share * (this.length[chosen] - before);
    this.time = undefined;
    this.frame = requestAnimationFrame((now) => this.step(now));
    this.changed?.();
  }

  stop() {
    cancelAnimationFrame(this.frame);
    this.frame = undefined;
    this.view.rest();
    this.changed?.();
  }

  step(now) {
    this.at += this.speed * 1e-3 * Math.min(200, now - (this.time ?? now));
    this.time = now;
    let i = chosen;
    while (i < count - 1 && this.length[i] < this.at) i++;
    const before = i > 0 ? this.length[i - 1] : 0, long = this.length[i] - before;
    const share = long > 0 ? Math.min(1, Math.max(0, (this.at - before) / long)) : 1;
    this.own = true;
    if (i !== chosen) choose(i, false);
    this.own = false;
    this.view.share = share;
    this.view.moving = true;
    this.view.later();
    if (i === count - 1 && share >= 1) return this.stop();
    this.frame = requestAnimationFrame((next) => this.step(next));
  }

  // A motion was chosen: by somebody, or by the playback.
  chosen() {
    this.view.share = 1;
    if (this.playing && !this.own) this.at = this.length[chosen];
    this.view.later();
  }
}

// The chosen motion: its line as posted, or as it was written for the side that is shown.
function lineOf(view) {
  const item = listed(motions.line[chosen]);
  let text = '';
  if (item) {
    const written = [...item.querySelectorAll('code.new, code.same')], posted = item.querySelector('code.old, code.same');
    const source = view.side && view.data.sides > 1 ? written[written.length - 1] : posted;
    text = source ? source.textContent.trim() : '';
  }
  const force = inAir(chosen) ? 'in air' : `${given.force_word} ${number(quantities.force.values[chosen], 0)} N`;
  const tool = view.cutters[chosen] < view.scene.numbers.length ? `tool ${view.scene.numbers[view.cutters[chosen]]}, ` : '';
  return [`line ${motions.line[chosen]}`, text, `${tool}${force}${view.known ? '' : ', the axes of the robot are not known'}`];
}

function showPart() {
  const place = byId('part-data');
  if (!place || !count) return;
  const live = byId('part-live');
  live.hidden = false;
  const canvas = byId('part'), view = new PartView(canvas, JSON.parse(place.textContent));
  if (!view.gl) { live.hidden = true; return; }
  canvas.view = view; // for scripts beside the page's
  byId('part-static').hidden = true;
  listenToInput(view);
  const play = new Playback(view), said = byId('part-line');
  const words = () => {
    const [line, text, rest] = lineOf(view), code = document.createElement('code');
    code.textContent = text;
    said.replaceChildren(`${line}: `, code, ` · ${rest}`);
    const slider = byId('part-motion');
    slider.value = chosen;
    slider.setAttribute('aria-valuetext', `${line}, ${rest}`);
  };
  byId('part-motion').max = count - 1;
  byId('part-motion').addEventListener('input', (event) => choose(+event.target.value, false));
  byId('part-side').addEventListener('input', (event) => {
    view.side = Math.min(+event.target.value, view.data.sides - 1);
    words();
    view.later(false);
  });
  const button = byId('part-play'), speed = byId('part-speed');
  play.changed = () => {
    button.textContent = play.playing ? 'pause' : 'play';
    byId('readout').setAttribute('aria-live', play.playing ? 'off' : 'polite'); // nobody listens to every motion
  };
  button.addEventListener('click', () => play.toggle());
  speed.value = 25 * Math.log10(play.speed);
  const faster = () => {
    play.speed = 10 ** (speed.value / 25);
    byId('part-pace').textContent = `${play.speed.toPrecision(2) * 1} mm/s`;
    speed.setAttribute('aria-valuetext', byId('part-pace').textContent);
  };
  speed.addEventListener('input', faster);
  faster();
  for (const name of ['robot', 'force', 'path']) {
    const box = byId(`part-${name}`);
    box.checked = view.shown[name];
    box.addEventListener('change', () => { view.shown[name] = box.checked; view.later(); });
  }
  const fit = (whole) => { view.whole = whole; view.fit(); };
  for (const one of document.querySelectorAll('[data-part-view]')) {
    one.addEventListener('click', () => view.look(one.dataset.partView));
  }
  byId('part-fit').addEventListener('click', () => fit(false));
  byId('part-cell').addEventListener('click', () => fit(true));
  byId('part-worst').addEventListener('click', () => view.worst());
  canvas.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const act = { ' ': () => play.toggle(), r: () => fit(!view.whole) }[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    act();
  });
  figures.push({ chosen() { play.chosen(); words(); } });
  play.chosen();
  view.paint();
  words();
  addEventListener('beforeprint', () => view.paint());
  addEventListener('afterprint', () => view.paint());
}

showPart();
