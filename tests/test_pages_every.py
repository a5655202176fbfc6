"""Every kind of page in a real browser: narrow and wide, light, dark and on paper; tables, and the program in it."""

from __future__ import annotations

import shutil
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from conftest import CELL, LINES

from postproc.cli.main import run
from postproc.report.picture_colours import contrast, dark_colour, follow_colours

pytest_plugins = ("browser",)

PLAN = (
    *("plan", "--robot", "kuka_kr270", "--effects", "joint_compliance", "--poses", 10, "--loads", 265),
    *("--tool", "0,500,300"),
)
MAP = ("map", "--robot", "kuka_kr270", "--x", "800:2200", "--y=-1000:1000", "--z", 500, "--grid", 8)
KINDS = (
    *("program", "prediction", "batch", "check", "verify", "plan", "map", "curve", "learn"),
    *("place", "identify", "diagnose"),
)
ROOT = Path(__file__).resolve().parent.parent
SECOND_PART = ROOT / "samples" / "kr270_second_part"


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Kind -> its page."""

    def called(*words):
        with pytest.raises(SystemExit) as end:
            run([str(word) for word in words])
        assert end.value.code in (None, 0, 3)

    folder = tmp_path_factory.mktemp("pages")
    (folder / "cell.yaml").write_text(CELL)
    program, other = folder / "part.src", folder / "compensated" / "part.src"
    program.write_text("\n".join([*LINES[:-1], "MOVE_ON()", LINES[-1]]) + "\n")
    found = {kind: folder / f"{kind}.html" for kind in KINDS}
    called(program, "--force")
    found["program"] = folder / "compensated" / "part.report.html"
    called("predict", program, "--force", "--report", folder / "out")
    found["prediction"] = folder / "out" / "part.prediction.html"
    called("batch", program, "--force", "-o", folder / "batch", "-j", 1)
    found["batch"] = folder / "batch" / "summary.html"
    called("check", program, "--page", found["check"])
    called("verify", program, other, "--force", "--page", found["verify"])
    called(*PLAN, "-o", folder / "plan.csv", "--page", found["plan"])
    called(*MAP, "--tool", "0,0,300", "--force=-360,0,560", "--page", found["map"])
    called(
        *MAP[:5],
        "--y",
        0,
        "--z",
        500,
        "--grid",
        9,
        "--tool",
        "0,0,300",
        "--force=0,0,-500",
        "--page",
        found["curve"],
    )
    part = folder / "second_part"
    shutil.copytree(SECOND_PART, part)
    called("learn", part / "part.src", part / "part1.csv", "--page", found["learn"])
    called("place", program, "--force", "--x", "1400:1600", "--y=-300:-100", "--page", found["place"])
    loads = ROOT / "samples" / "kr270_campaign" / "loads.csv"
    called("identify", loads, "--effects", "joint_compliance", "--page", found["identify"])
    plain = ROOT / "samples" / "kr270_missing_compensator"
    robot = ("--robot", plain / "kr270_plain.yaml")
    called("diagnose", plain / "loads.csv", *robot, "--page", found["diagnose"])
    return found


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_narrow_and_wide_light_and_dark(window, pages, kind):
    """Nothing is wider than the window, axe-core finds nothing, the ground is that of the scheme."""
    for wide, scheme in product((390, 1400), ("light", "dark")):
        size = {"width": wide, "height": 800}
        shown = window(pages[kind], viewport=size, color_scheme=scheme, bypass_csp=True)
        shown.page.evaluate("document.querySelectorAll('details').forEach(one => { one.open = true; })")
        assert shown.page.evaluate("document.documentElement.scrollWidth") <= wide
        assert shown.violations() == []
        assert shown.complaints == []
        for selector in ("#view3d", "#error", "#correction", ".drawn img"):
            if shown.page.locator(selector).count():
                drawn = shown.pixels(selector)
                corner = drawn[3:9, 3:9].mean()
                assert corner > 240 if scheme == "light" else corner < 60, selector
                assert (np.abs(drawn - drawn[4, 4]).sum(axis=2) > 150).mean() > 0.002, selector


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["program", "prediction", "map", "learn", "place"])
def test_on_paper_the_picture_is_there(window, pages, kind):
    """Of a dark screen: the ground is white, and the first picture has ink of more than one colour."""
    pdfium = pytest.importorskip("pypdfium2", reason="pypdfium2 is not installed")
    shown = window(pages[kind], color_scheme="dark")
    paper = pdfium.PdfDocument(shown.page.pdf())
    inked = []
    for page in paper:
        image = np.asarray(page.render(scale=1.0).to_pil().convert("RGB")).astype(int)
        assert np.median(image) > 250
        coloured = (image.max(axis=2) - image.min(axis=2)) > 60
        inked.append(coloured)
    if kind in ("map", "learn", "place"):
        assert max(one.sum() for one in inked) > (5000 if kind == "map" else 2000)
        return
    # the path, in the colours of its scale: dark violet and green, which no chart has
    violet = 0
    for page in paper:
        image = np.asarray(page.render(scale=2.0).to_pil().convert("RGB")).astype(int)
        red, green, blue = np.moveaxis(image, -1, 0)
        violet += ((abs(red - 72) < 30) & (green < 60) & (abs(blue - 100) < 40)).sum()
    assert violet > 150


@pytest.mark.slow
def test_tables_sort_and_filter(window, pages):
    page = window(pages["plan"]).page
    table = page.locator("table").nth(1)
    column = "one => [...one.tBodies[0].rows].filter(row => !row.hidden).map(row => +row.cells[1].innerText)"
    first = table.evaluate(column)
    head = table.locator("thead th").nth(1)
    for order, wanted in (("ascending", sorted(first)), ("descending", sorted(first)[::-1]), (None, first)):
        head.locator("button").click()
        assert head.get_attribute("aria-sort") == order
        assert table.evaluate(column) == wanted
    assert first != sorted(first)
    word = table.locator("tbody td").nth(1).inner_text()
    page.locator(".filter input").fill(word)
    kept = table.evaluate(column)
    assert 0 < len(kept) < len(first)
    assert page.locator(".filter output").inner_text() == f"{len(kept)} of {len(first)} rows"
    page.locator(".filter input").fill("")
    assert table.evaluate(column) == first


@pytest.mark.slow
def test_a_line_opens_the_program_at_its_place(window, pages):
    shown = window(pages["program"])
    page = shown.page
    listing = page.locator("#listing")
    assert not listing.is_visible()
    link = page.locator("table.places a").first
    line = link.get_attribute("href")
    link.click()
    item = page.locator(line)
    assert item.evaluate("one => one.classList.contains('chosen')")
    inside = "one => { const [a, b] = [one, one.closest('.listing')].map(n => n.getBoundingClientRect());"
    assert item.evaluate(inside + " return a.top >= b.top && a.bottom <= b.bottom; }")
    assert page.evaluate("document.activeElement.id") == "listing"
    assert item.locator("code.old").is_visible()
    assert item.locator("code.new").first.is_visible()
    for version, old, new in (("before", True, False), ("after", False, True)):
        page.select_option("#versions", version)
        assert item.locator("code.old").is_visible() == old
        assert item.locator("code.new").first.is_visible() == new
    # a finding leads there as well, and so does the chosen motion
    named = page.locator("section[aria-labelledby=findings] a")
    assert named.count() >= 1
    page.fill("#line", "10")
    page.keyboard.press("Tab")
    page.click("#in-program")
    assert page.locator("#L10.chosen").count() == 1
    assert shown.complaints == []


# Colours of a picture.


def test_hues_of_a_picture_can_be_told_from_the_dark_ground():
    for colour in [(r, g, b) for r in (0, 90, 200) for g in (0, 90, 200) for b in (0, 90, 255)]:
        dark = dark_colour(colour)
        if max(colour) - min(colour) >= 24:
            assert contrast(dark, (0x14, 0x16, 0x1A)) >= 4.5
    assert dark_colour((255, 255, 255)) == (0x14, 0x16, 0x1A)
    assert dark_colour((0, 0, 0)) == (0xE9, 0xEB, 0xEF)
    assert contrast((0, 0, 0), (255, 255, 255)) == pytest.approx(21.0)


def test_a_picture_keeps_all_but_one_style_sheet():
    svg = b'<?xml version="1.0"?>\n<svg width="3"><path style="fill: none; stroke: #000000"/></svg>'
    done = follow_colours(svg)
    start, stop = done.index(b"<style>"), done.index(b"</style>") + len(b"</style>")
    assert done[:start] + done[stop:] == svg
    assert b"stroke: #e9ebef !important" in done
    assert follow_colours(b"no picture") == b"no picture"


def test_a_scale_of_many_hues_is_left_as_it_is():
    hues = [f"{k:02x}40ff" for k in range(0, 160, 8)]
    svg = "<svg>" + "".join(f'<path style="fill: #{hue}"/>' for hue in hues) + "</svg>"
    assert b"!important" not in follow_colours(svg.encode())
