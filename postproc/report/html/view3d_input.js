// What the pointer, the wheel and the keys do to the 3-D view.

function listenToInput(view) {
  const { canvas } = view;
  const held = new Map();
  let still = 0, spread = 0;
  canvas.addEventListener('pointerdown', (event) => {
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, [event.clientX, event.clientY]);
    still = 0;
    canvas.classList.add('dragged');
  });
  canvas.addEventListener('pointermove', (event) => {
    const before = held.get(event.pointerId);
    if (!before) return view.hover(...view.canvas2d.at(event));
    const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
    held.set(event.pointerId, [event.clientX, event.clientY]);
    still += Math.abs(dx) + Math.abs(dy);
    view.hover(-1e9, -1e9);
    if (held.size === 2) {
      const [a, b] = [...held.values()], now = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (spread) view.zoomAt(now / spread, ...view.canvas2d.at(event));
      spread = now;
    } else if (event.shiftKey || event.buttons & 6) view.move(dx, dy);
    else view.turn(dx / 150, dy / 150);
  });
  const drop = (event) => {
    held.delete(event.pointerId);
    spread = 0;
    canvas.classList.remove('dragged');
    if (event.type === 'pointerup' && still < 5) {
      const at = view.find(...view.canvas2d.at(event));
      if (at >= 0) choose(at, false);
    }
    view.rest();
  };
  canvas.addEventListener('pointerup', drop);
  canvas.addEventListener('pointercancel', drop);
  canvas.addEventListener('pointerleave', () => view.hover(-1e9, -1e9));
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('dblclick', () => view.fit());
  canvas.addEventListener('wheel', (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    view.zoomAt(Math.exp(-event.deltaY / 500), ...view.canvas2d.at(event));
    view.restSoon();
  }, { passive: false });
  canvas.addEventListener('keydown', (event) => {
    const by = event.shiftKey ? 'move' : 'turn', step = event.shiftKey ? 40 : 0.12;
    const act = {
      ArrowLeft: () => view[by](-step, 0), ArrowRight: () => view[by](step, 0),
      ArrowUp: () => view[by](0, -step), ArrowDown: () => view[by](0, step),
      '+': () => view.zoomAt(1.25, ...view.heart()), '=': () => view.zoomAt(1.25, ...view.heart()),
      '-': () => view.zoomAt(0.8, ...view.heart()), 0: () => view.fit(),
      n: () => choose(chosen + 1, true), p: () => choose(chosen - 1, true),
    }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    act();
    view.restSoon();
  });
}
