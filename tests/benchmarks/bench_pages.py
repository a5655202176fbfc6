"""What the report of 100,000 motions costs: to write all of it, and to open the page.

    python -m pytest tests/benchmarks/bench_pages.py

The clock, for a browser has its own processes.  Goals: 5 s beyond the compensation, 15 MB, 3 s to the first paint.
"""

import time

import numpy as np
import pytest

from postproc.workflows.preparation import Request
from postproc.workflows.program import compensate

pytest_plugins = ("browser",)

MOTIONS, EACH = 100_000, 500
CELL = """\
robot: kuka_kr270
tools:
  1: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}
bases:
  1: {x: 1500, y: -200, z: 600, a: 0, b: 0, c: 0}
start: [0, -90, 90, 0, 45, 0]
"""
SECONDS, BYTES, PAINT = 5.0, 15e6, 3.0


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The page, and seconds from the end of the correction to the end of the job."""
    folder = tmp_path_factory.mktemp("many")
    (folder / "cell.yaml").write_text(CELL)
    lines = [
        "DEF many()",
        "$BASE=BASE_DATA[1]",
        "$TOOL=TOOL_DATA[1]",
        "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}",
    ]
    lines += ["$VEL.CP=0.05", "LIN {X 0,Y 0,Z 50,A 0,B 0,C 180}"]
    turn = 2 * np.pi * np.arange(EACH) / 100
    radius = 20 + 0.4 * np.arange(EACH)
    for layer in range(MOTIONS // EACH):
        lines += ["LIN {X 220.000,Y 0.000,Z 20.000}", ";FORCE -120 50 260 @feed"]
        places = zip(200 + radius * np.cos(turn), radius * np.sin(turn), strict=True)
        lines += [f"LIN {{X {x:.3f},Y {y:.3f},Z {-0.05 * layer:.3f}}} C_DIS" for x, y in places]
        lines += [";FORCE OFF", "LIN {Z 50.000}"]
    (folder / "many.src").write_text("\n".join([*lines, "END", ""]))
    begun = {}
    compensate(
        Request(folder / "many.src", force=""), lambda stage: begun.setdefault(stage, time.monotonic())
    )
    return folder / "compensated" / "many.report.html", time.monotonic() - begun["reporting"]


def test_writing(written):
    path, seconds = written
    print(
        f"\nall reports of {MOTIONS} motions: {seconds:.2f} s ({SECONDS:g}), page {path.stat().st_size / 1e6:.1f} MB"
    )
    assert path.stat().st_size <= BYTES


def test_opening(written, chromium):
    path, _ = written
    page = chromium.new_page(viewport={"width": 1280, "height": 900})
    begin = time.monotonic()
    page.goto(path.as_uri())
    page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    drawn = time.monotonic() - begin
    paint = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime") / 1e3
    page.locator("#space").scroll_into_view_if_needed()
    box = page.locator("#space").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.evaluate("times = []; (f = t => { times.push(t); requestAnimationFrame(f); })(0)")
    for step in range(60):
        page.mouse.move(x + 4 * step, y + 2 * step)
    frames = np.diff(page.evaluate("times.slice(1)"))
    page.close()
    print(
        f"\nfirst paint {paint:.2f} s ({PAINT:g}), all figures drawn {drawn:.2f} s; while it turns"
        f" {np.mean(frames):.0f} ms a frame, {np.percentile(frames, 95):.0f} ms below which 95 %"
    )
