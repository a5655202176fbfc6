"""How fluid the view of a part is in Chromium: frames a second of a page, with its path or with one of many points.

    python -m tests.benchmarks.part_view PAGE.html [--points 1000000]

The view is turned, played and at rest; median and 95th percentile of the time from frame to frame, and the size of the
page.  Chromium draws without a graphics card here, so a machine with one is faster.
"""

from __future__ import annotations

import argparse
import base64
import json
import re
import sys
import zlib
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from browser import CHROMIUM, FLAGS
from playwright.sync_api import sync_playwright

FRAMES = 60
TIMES = """async ([what, frames]) => {
  const canvas = document.getElementById('part'), box = canvas.getBoundingClientRect();
  const send = (type, x) => canvas.dispatchEvent(new PointerEvent(type, {
    pointerId: 1, clientX: box.left + 300 + x, clientY: box.top + 200, buttons: 1, bubbles: true }));
  canvas.setPointerCapture = () => {};
  if (what === 'turned') send('pointerdown', 0);
  if (what === 'played') document.getElementById('part-play').click();
  const times = [];
  for (let k = 0, last; k < frames; k++) {
    if (what === 'turned') send('pointermove', 3 * k);
    if (what === 'redrawn') document.getElementById('part-path').dispatchEvent(new Event('change'));
    const now = await new Promise(requestAnimationFrame);
    canvas.getContext('webgl2').finish();
    if (last !== undefined) times.push(now - last);
    last = now;
  }
  if (what === 'turned') send('pointerup', 0);
  if (what === 'played') document.getElementById('part-play').click();
  return times;
}"""


def with_points(text: str, count: int) -> str:
    """The page with a zigzag of so many points over the part as its path."""
    found = re.search(r'(id="part-data">)(.*?)(</script>)', text, re.S)
    assert found is not None
    data = json.loads(found[2])
    x = np.abs((np.arange(count) % 2000) - 1000) / 1000
    z = 0.5 + 0.4 * np.sin(9 * x) * np.cos(np.arange(count) / count * 20)
    grid = np.round(np.stack([x, np.arange(count) / count, z], axis=1) * 65535).astype(np.int64)
    steps = np.diff(grid, axis=0, prepend=0) & 0xFFFF
    planes = np.concatenate([part for axis in steps.T for part in (axis & 0xFF, axis >> 8)])
    packed = base64.b64encode(zlib.compress(planes.astype(np.uint8).tobytes(), 6)).decode()
    data["scene"]["path"] |= {"count": count, "all": count, "data": packed}
    return text[: found.start(2)] + json.dumps(data) + text[found.end(2) :]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("page", type=Path)
    parser.add_argument("--points", type=int, default=0)
    given = parser.parse_args()
    text = given.page.read_text(encoding="utf-8")
    if given.points:
        text = with_points(text, given.points)
    with TemporaryDirectory() as folder, sync_playwright() as driver:
        page = Path(folder) / "page.html"
        page.write_text(text, encoding="utf-8")
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        window = browser.new_page(viewport={"width": 1400, "height": 900})
        window.goto(page.as_uri())
        window.wait_for_function("() => document.getElementById('part').dataset.points", timeout=300_000)
        window.check("#part-path")
        points = window.get_attribute("#part", "data-points")
        vertices = len(json.loads(window.inner_text("#part-data") or "{}").get("vertices", "")) * 3 // 32
        print(f"{len(text) / 1e6:.1f} MB, path of {points} points, surface of {vertices} vertices")
        for what in ("turned", "played", "redrawn"):
            times = np.array(window.evaluate(TIMES, [what, FRAMES]))
            level = window.get_attribute("#part", "data-level")
            usual, long = np.median(times), np.percentile(times, 95)
            print(f"{what:8} {usual:6.1f} ms a frame, 95 % below {long:.1f} ms, level of detail {level}")
        browser.close()


if __name__ == "__main__":
    main()
