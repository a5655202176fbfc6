"""The part on the page of a program: the numbers that its script draws, the table, and what a browser shows."""

import base64
import json
import re
import shutil

import numpy as np
import pytest

pytest.importorskip("numba")

from postproc.workflows.preparation import Request
from postproc.workflows.program import compensate

pytest_plugins = ("browser",)

SAMPLE = "samples/kr270_stock"


@pytest.fixture(scope="module")
def page(tmp_path_factory, pytestconfig):
    folder = tmp_path_factory.mktemp("page")
    shutil.copytree(pytestconfig.rootpath / "robots", folder / "robots")
    shutil.copytree(pytestconfig.rootpath / SAMPLE, folder / SAMPLE)
    report = compensate(Request(folder / SAMPLE / "part.ngc", force=""))
    return folder / SAMPLE / "compensated" / "part.report.html", report


def numbers(data, name, form):
    return np.frombuffer(base64.b64decode(data[name]), form)


@pytest.mark.slow
def test_what_the_script_draws_is_what_the_report_says(page):
    path, report = page
    text = path.read_text(encoding="utf-8")
    assert len(text) < 10e6
    data = json.loads(re.search(r'id="part-data">(.*?)</script>', text, re.S)[1])
    part = report.as_json()["part_error_mm"]
    places = numbers(data, "vertices", "<u2").reshape(-1, 4)[:, :3]
    errors = numbers(data, "errors", "<i2").reshape(-1, 2).astype(float)
    faces = numbers(data, "faces", "<u4")
    assert data["corners"] == len(faces)
    assert faces.max() < len(places) == len(errors)
    assert data["extent"] == pytest.approx([120, 80, 30], abs=0.1)
    # after, nothing is beyond the range; the largest gouge and excess are those of the report
    after = errors[errors[:, 1] > -32768, 1] / 32767 * data["range"]
    assert after.max() == pytest.approx(part["after"]["excess_max"], abs=1e-5)
    assert -after.min() == pytest.approx(part["after"]["gouge_max"], abs=1e-5)
    # beyond the tolerance before: most of what the program makes, and nothing else
    before = errors[errors[:, 0] > -32768, 0] / 32767 * data["range"]
    assert (np.abs(before) > data["tolerance"]).mean() == pytest.approx(
        part["before"]["out_of_tolerance"], abs=0.05
    )
    for side in ("before", "after"):
        assert f"{part[side]['gouge_max']:.4f}" in text


@pytest.mark.slow
def test_a_browser_shows_the_part(page, request):
    """As a picture where WebGL is missing, else drawn; as posted its floor is blue, too deep by more than twice the
    tolerance."""
    browser = request.getfixturevalue("chromium")
    window = browser.new_page(viewport={"width": 1100, "height": 900})
    errors = []
    window.on("pageerror", lambda error: errors.append(str(error)))
    window.goto(page[0].as_uri())
    drawn = not window.eval_on_selector("#part-live", "e => e.hidden")
    assert window.eval_on_selector("#part-static", "e => e.hidden") == drawn
    if drawn:
        window.evaluate(
            "const s = document.getElementById('part-side'); s.value = 0; s.dispatchEvent(new Event('input'))"
        )
        window.wait_for_timeout(500)
    import io

    from PIL import Image

    shot = window.locator("#part" if drawn else "#part-static img >> nth=0").screenshot()
    pixels = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)
    blue = (pixels[..., 2] > 2 * pixels[..., 0]) & (pixels[..., 2] > 60)
    grey = (np.ptp(pixels, axis=2) < 6) & (pixels[..., 0] > 60) & (pixels[..., 0] < 200)
    assert blue.mean() > 0.05
    assert grey.mean() > 0.1
    assert not errors
    window.close()
