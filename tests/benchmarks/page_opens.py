"""How long a page takes until it is there in Chromium: ``python -m tests.benchmarks.page_opens PAGE.html ...``.

From the request to the end of the load, and to the second frame after it, when all that is drawn at first is drawn; the
median of some, each in a window of its own, by the clock, and what the page's process computed.  Chromium draws
without a graphics card here, so a machine with one is faster.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).parents[1]))

from browser import CHROMIUM, FLAGS
from playwright.sync_api import Browser, sync_playwright

from tests.benchmarks.machine import heading

TIMES = 5
GOAL = 1.0
"""[s]"""

DRAWN = """async () => {
  const frame = () => new Promise(requestAnimationFrame);
  await frame();
  await frame();
  const [entry] = performance.getEntriesByType('navigation');
  return [entry.loadEventEnd / 1000, performance.now() / 1000];
}"""


def opened(browser: Browser, page: Path) -> tuple[float, float, float]:
    """[s] until it is loaded, until it is drawn, and of its process."""
    window = browser.new_page(viewport={"width": 1400, "height": 900})
    watched = window.context.new_cdp_session(window)
    watched.send("Performance.enable")
    window.goto(page.resolve().as_uri())
    loaded, drawn = window.evaluate(DRAWN)
    metrics = {one["name"]: one["value"] for one in watched.send("Performance.getMetrics")["metrics"]}
    window.close()
    return loaded, drawn, metrics["ProcessTime"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("pages", type=Path, nargs="+")
    given = parser.parse_args()
    print(heading())
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        for page in given.pages:
            columns = zip(*(opened(browser, page) for _ in range(TIMES)), strict=True)
            loaded, drawn, computed = (median(column) for column in columns)
            print(
                f"{page.name}, {page.stat().st_size / 1e6:.1f} MB: loaded after {loaded:.2f} s, drawn after"
                f" {drawn:.2f} s  (wanted {GOAL:g} s); processor {computed:.2f} s"
            )
        browser.close()


if __name__ == "__main__":
    main()
