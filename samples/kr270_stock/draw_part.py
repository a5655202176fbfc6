"""Draws part.png: the part as posted and as compensated with the robot at one motion, as the page of the report has it.

The command runs in a temporary copy; Chromium (by playwright) opens its page, and the view is photographed twice.

    python samples/kr270_stock/draw_part.py [FILE.png]
"""

from __future__ import annotations

import io
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image
from playwright.sync_api import Browser, sync_playwright

from postproc.cli.main import run

HERE = Path(__file__).resolve().parent
LINE = 200  # of the program: the robot stands at its end
SIZE = {"width": 640, "height": 900}
COLOURS = 96

CHOOSE = """([line, side]) => {
  const set = (id, value, event) => {
    const input = document.getElementById(id);
    input.value = value;
    input.dispatchEvent(new Event(event));
  };
  set('line', line, 'change');
  set('part-side', side, 'input');
}"""


def make_page(folder: Path) -> Path:
    shutil.copytree(HERE.parents[1] / "robots", folder / "robots")
    place = folder / "samples" / HERE.name
    shutil.copytree(HERE, place, ignore=shutil.ignore_patterns("compensated"))
    try:
        run([str(place / "part.ngc"), "--force", "-q"])
    except SystemExit as end:
        if end.code not in (0, 3):
            raise
    return place / "compensated" / "part.report.html"


def photograph(page: Path, browser: Browser) -> list[Image.Image]:
    """As posted, and as compensated."""
    shots = []
    window = browser.new_page(viewport=SIZE, color_scheme="light")
    window.goto(page.as_uri())
    for side in (0, 1):
        window.evaluate(CHOOSE, [LINE, side])
        window.wait_for_timeout(500)
        shots.append(Image.open(io.BytesIO(window.locator("#part").screenshot())).convert("RGB"))
    window.close()
    return shots


def main() -> None:
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "part.png"
    with TemporaryDirectory() as folder:
        page = make_page(Path(folder))
        with sync_playwright() as driver:
            path = next(path for name in ("chromium", "google-chrome") if (path := shutil.which(name)))
            browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-gpu"])
            shots = photograph(page, browser)
            browser.close()
    wide, high = shots[0].size
    both = Image.new("RGB", (2 * wide, high), "white")
    for index, shot in enumerate(shots):
        both.paste(shot, (index * wide, 0))
    both.quantize(COLOURS).save(out, optimize=True)


if __name__ == "__main__":
    main()
