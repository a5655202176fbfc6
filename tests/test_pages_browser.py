"""The page of a program in a real browser: it draws, tells what is under the pointer, asks for nothing."""

from __future__ import annotations

import csv
import re

import numpy as np
import pytest
from conftest import CELL, LINES

pytest_plugins = ("browser",)
pytestmark = pytest.mark.slow

HOSTILE = ";</code></script><script>window.hacked=1</script><img src=x onerror='window.hacked=1'>&amp;"
"""What a comment behind a motion may say."""


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A compensated program with hostile comments, in a folder with a hostile name."""
    from postproc.workflows.preparation import Request
    from postproc.workflows.program import compensate

    folder = tmp_path_factory.mktemp("page") / "it's <b>&\"50%#1"
    folder.mkdir()
    (folder / "cell.yaml").write_text(CELL)
    lines = [line + HOSTILE if "C_DIS" in line else line for line in LINES]
    lines.insert(8, ";FORCE <script>window.hacked=1</script>")
    (folder / "part.src").write_text("\n".join(lines) + "\n")
    compensate(Request(folder / "part.src", force="", no_insert=True))
    return folder / "compensated"


@pytest.fixture(scope="module")
def rows(done):
    """The corrections by line."""
    with open(done / "part.corrections.csv", newline="") as stream:
        return {int(row["line"]): row for row in csv.DictReader(stream)}


def test_it_asks_for_nothing_and_complains_of_nothing(window, done):
    shown = window(done / "part.report.html")
    page = shown.page
    for selector in ("#view3d", "#error", "#correction"):
        page.locator(selector).hover()
        page.locator(selector).click()
    page.keyboard.press("ArrowRight")
    shown.frames()
    assert shown.requests == [(done / "part.report.html").as_uri()]
    assert shown.complaints == []


def test_what_a_comment_says_is_shown_and_does_not_run(window, done):
    shown = window(done / "part.report.html")
    shown.page.wait_for_timeout(200)
    assert shown.page.evaluate("typeof window.hacked") == "undefined"
    assert "<script>window.hacked=1</script><img src=x" in shown.page.locator("table.places").inner_text()
    assert shown.page.locator("main img, table script").count() == 0
    findings = shown.page.locator("section[aria-labelledby=findings]").inner_text()
    assert "<script>window.hacked=1</script>" in findings


def test_a_script_that_got_in_would_not_run(window, done, tmp_path):
    """The policy stands behind the escaping: even where a tag is in the page, it is not obeyed."""
    page = (done / "part.report.html").read_text(encoding="utf-8")
    (tmp_path / "x.html").write_text(
        page.replace(
            "</main>", "<script>window.hacked=1</script><img src='https://example.com/x.png'></main>"
        ),
        encoding="utf-8",
    )
    shown = window(tmp_path / "x.html")
    assert shown.page.evaluate("typeof window.hacked") == "undefined"
    assert len(shown.complaints) == 2


def test_the_path_is_drawn(window, done):
    shown = window(done / "part.report.html")
    drawn = shown.pixels("#view3d")
    ground = drawn[5, 5]
    ink = np.abs(drawn - ground).sum(axis=2) > 60
    assert ink.sum() > 3000
    assert len({tuple(colour) for colour in drawn[ink].reshape(-1, 3)[::7].tolist()}) > 20
    # another quantity, arrows, the deflected path, and another view each change what is seen
    for act in (
        lambda page: page.select_option("#quantity", "force"),
        lambda page: page.uncheck("#arrows"),
        lambda page: page.check("#deflected"),
        lambda page: page.click("text=top"),
    ):
        before = shown.pixels("#view3d")
        act(shown.page)
        assert (np.abs(shown.pixels("#view3d") - before).sum(axis=2) > 60).sum() > 50


def test_turning_and_zooming(window, done):
    shown = window(done / "part.report.html")
    page = shown.page
    page.locator("#view3d").scroll_into_view_if_needed()
    box = page.locator("#view3d").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    first = shown.pixels("#view3d")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 120, y + 40, steps=5)
    page.mouse.up()
    turned = shown.pixels("#view3d")
    page.mouse.wheel(0, -400)
    page.wait_for_timeout(300)
    zoomed = shown.pixels("#view3d")
    page.keyboard.press("0")
    page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(300)
    keyed = shown.pixels("#view3d")
    for one, other in ((first, turned), (turned, zoomed), (zoomed, keyed)):
        assert (np.abs(one - other).sum(axis=2) > 60).sum() > 200


def test_a_chart_shows_a_part_and_all_again(window, done):
    shown = window(done / "part.report.html")
    page = shown.page
    whole = shown.pixels("#correction")
    page.click("[data-zoom=in]")
    part = shown.pixels("#correction")
    page.focus("#correction")
    page.keyboard.press("-")
    page.keyboard.press("0")
    page.evaluate("document.activeElement.blur()")
    assert (np.abs(part - whole).sum(axis=2) > 60).sum() > 300
    assert np.abs(shown.pixels("#correction") - whole).max() == 0
    before = shown.pixels("#error")
    page.check("#linear")
    assert (np.abs(shown.pixels("#error") - before).sum(axis=2) > 60).sum() > 300


def test_hover_tells_line_and_figures(window, done, rows):
    """Wherever the pointer meets the path, what is told stands so in the corrections."""
    shown = window(done / "part.report.html")
    page = shown.page
    page.locator("#view3d").scroll_into_view_if_needed()
    box = page.locator("#view3d").bounding_box()
    told = {}
    for x in np.arange(box["x"] + 20, box["x"] + box["width"] - 20, 22):
        for y in np.arange(box["y"] + 20, min(box["y"] + box["height"], 880) - 20, 22):
            page.mouse.move(x, y)
            if not page.locator("#tip").is_hidden():
                text = page.locator("#tip").inner_text()
                told[int(re.match(r"line (\d+):", text)[1])] = text
    cutting = {line for line, row in rows.items() if row["state"] == "corrected"}
    assert len(cutting & told.keys()) >= 3
    assert told.keys() <= rows.keys()
    for line in cutting & told.keys():
        row = rows[line]
        assert float(re.search(r"error before (\S+)", told[line])[1]) == pytest.approx(
            float(row["error_before_mm"]), abs=6e-4
        )
        shift = [float(v) for v in re.search(r"X Y Z (\S+), (\S+), (\S+) mm", told[line]).groups()]
        np.testing.assert_allclose(shift, [float(row[f"correction_{c}_mm"]) for c in "xyz"], atol=6e-4)
        assert float(re.search(r"force (\d+) N", told[line])[1]) == pytest.approx(
            np.linalg.norm([float(row[f"f{c}_n"]) for c in "xyz"]), abs=0.6
        )


def test_without_a_mouse(window, done, rows):
    shown = window(done / "part.report.html")
    page = shown.page
    readout = page.locator("#readout")
    line = lambda: int(re.match(r"line (\d+):", readout.inner_text())[1])  # noqa: E731
    first = line()
    before = [row["error_before_mm"] for row in rows.values() if row["error_before_mm"]]
    assert rows[first]["error_before_mm"] == max(before, key=float)  # the worst place is where one begins
    order = list(rows)
    page.focus("#error")
    page.keyboard.press("ArrowLeft")
    assert line() == order[order.index(first) - 1]
    assert page.get_attribute("#error", "aria-valuetext").startswith(f"line {line()}:")
    assert page.input_value("#line") == str(line())
    page.keyboard.press("End")
    assert line() == order[-1]
    page.focus("#view3d")
    page.keyboard.press("p")
    assert line() == order[-2]
    page.fill("#line", str(order[2]))
    page.keyboard.press("Tab")
    assert line() == order[2]
    button = page.locator("table.places tbody button").first
    button.focus()
    page.keyboard.press("Enter")
    assert line() == int(button.inner_text())
    # every control is reached with the Tab key, in the order of the page
    page.reload()
    reached = []
    for _ in range(80):
        page.keyboard.press("Tab")
        at = page.evaluate("document.activeElement.id || 'text ' + document.activeElement.textContent.trim()")
        if reached and at == reached[0]:
            break
        reached.append(at)
    wanted = ["quantity", "arrows", "view3d", "motion", "line", "error", "correction"]
    assert [name for name in reached if name in wanted] == wanted


def test_light_and_dark(window, done):
    """Both have their ground, and words that stand out from it (WCAG 2: 4.5 to 1)."""
    means = {}
    for scheme in ("light", "dark"):
        shown = window(done / "part.report.html", color_scheme=scheme)
        means[scheme] = shown.pixels("#view3d")[5, 5].mean()
        assert shown.pixels("#error")[2, 100].mean() == pytest.approx(means[scheme], abs=6)
        for selector in (
            "body",
            ".what",
            ".sentence",
            ".tiles dt",
            ".badge",
            "a",
            "code.old",
            "code.new",
            ".help",
        ):
            ink, ground = shown.page.eval_on_selector(selector, GROUND)
            assert _contrast(ink, ground) >= 4.5, (scheme, selector)
    assert means["light"] > 240
    assert means["dark"] < 40


def test_on_paper_it_is_light_and_without_buttons(window, done):
    shown = window(done / "part.report.html", color_scheme="dark")
    shown.page.emulate_media(media="print", color_scheme="dark")
    shown.page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert shown.pixels("#error")[2, 100].mean() > 240
    assert not shown.page.locator("#quantity").is_visible()
    assert shown.page.locator("#error-legend").is_visible()
    assert shown.page.locator("table.places code.new").first.is_visible()


def test_without_scripts_the_words_are_there(chromium, done):
    context = chromium.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((done / "part.report.html").as_uri())
    text = page.locator("main").inner_text()
    context.close()
    assert "drawn by a script, which is switched off here" in text
    assert "the largest predicted error falls from" in text
    assert "joint_compliance" in text


def test_the_links_lead_to_the_files(window, done):
    shown = window(done / "part.report.html")
    names = shown.page.eval_on_selector_all(
        "ul.files a", "all => all.map(a => decodeURIComponent(a.pathname))"
    )
    assert {name.rsplit("/", 1)[1] for name in names} == {
        "part.diff",
        "part.corrections.csv",
        "part.report.json",
        "part.src",
    }
    assert {name.rsplit("/", 1)[0] for name in names} == {str(done)}


GROUND = """node => {
  const ink = getComputedStyle(node).color;
  for (let at = node; at; at = at.parentElement) {
    const ground = getComputedStyle(at).backgroundColor;
    if (!ground.endsWith(', 0)')) return [ink, ground];
  }
  return [ink, 'rgb(255, 255, 255)'];
}"""


def _contrast(ink: str, ground: str) -> float:
    def light(colour):
        channels = np.array([float(v) for v in re.findall(r"[\d.]+", colour)[:3]]) / 255
        linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
        return linear @ [0.2126, 0.7152, 0.0722]

    low, high = sorted((light(ink), light(ground)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("lines", [LINES, [*LINES[:4], "END"], [*LINES[:7], "END"]])
def test_programs_with_nothing_to_show_have_a_page_too(window, tmp_path, lines):
    """Without a force, without a motion, without a cut."""
    from postproc.workflows.preparation import Request
    from postproc.workflows.program import compensate

    (tmp_path / "cell.yaml").write_text(CELL)
    (tmp_path / "part.src").write_text("\n".join(lines) + "\n")
    compensate(Request(tmp_path / "part.src", force="0,0,0"))
    shown = window(tmp_path / "compensated" / "part.report.html")
    shown.page.locator("#view3d").hover()
    shown.page.locator("#error").click()
    shown.page.keyboard.press("ArrowRight")
    assert shown.complaints == []
    assert shown.page.locator(".sentence").inner_text()
