"""Pages of a map, an identification and a diagnosis: they say what the terminal says, and escape it."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console
from test_pages import HOSTILE, Tags

from postproc.base.findings import Finding, Refusal
from postproc.report.diagnosed_terminal import show_diagnosed
from postproc.report.identified_terminal import show_identified
from postproc.report.mapped import show_map
from postproc.report.page_results import diagnosed_page, identified_page, mapped_page
from postproc.workflows.diagnose import DiagnoseRequest, diagnose_robot
from postproc.workflows.identify import IdentifyRequest, identify
from postproc.workflows.map import MapRequest, map_workspace

pytest_plugins = ("browser",)

SAMPLES = Path(__file__).parents[1] / "samples"
MAP = MapRequest(
    robot="kuka_kr270",
    ranges_mm=((1000.0, 2000.0), (-400.0, 400.0), (500.0,)),
    points=5,
    tool_mm_deg=(0.0, 0.0, 300.0, 0.0, 0.0, 0.0),
    orientation_deg=(0.0, 0.0, 180.0),
    wrench=(-360.0, 0.0, 560.0, 0.0, 0.0, 0.0),
    frame="base",
)


def mapped(folder):
    return map_workspace(replace(MAP, page=folder / "map.html", csv=folder / "sub" / "map.csv"))


def identified(folder):
    data, effects = SAMPLES / "kr270_campaign" / "loads.csv", ("joint_compliance", "gravity_compensator")
    written = {"output": folder / "new.yaml", "page": folder / "identify.html"}
    return identify(IdentifyRequest((data,), effects=effects, bootstrap=20, **written))


def diagnosed(folder):
    data, robot = (SAMPLES / "kr270_missing_compensator" / name for name in ("loads.csv", "kr270_plain.yaml"))
    written = {"output": folder / "found.yaml", "page": folder / "diagnose.html"}
    return diagnose_robot(DiagnoseRequest((data,), str(robot), **written))


WAYS = {
    "map": (mapped, show_map, mapped_page),
    "identify": (identified, show_identified, identified_page),
    "diagnose": (diagnosed, show_diagnosed, diagnosed_page),
}


@pytest.fixture(scope="module", params=WAYS)
def one(request, tmp_path_factory):
    """A result, its page, how it is shown on a terminal, how its page is made."""
    folder = tmp_path_factory.mktemp("results")
    make, show, page = WAYS[request.param]
    return make(folder), folder / f"{request.param}.html", show, page


@pytest.mark.slow
def test_the_page_says_what_the_terminal_says(one):
    result, page, show, _ = one
    stream = io.StringIO()
    show(Console(file=stream, width=4000, highlight=False), result, True)
    seen = " ".join(Tags(page.read_text(encoding="utf-8")).text.split())
    said = [
        line
        for line in stream.getvalue().splitlines()
        if not line.startswith(("wrote ", "stiffest", "softest"))
    ]
    words = {word for line in said for word in line.split() if any(c.isdigit() for c in word)}
    missing = {word for word in words if word.strip("();,") not in seen}
    assert len(words) > 20
    assert missing == set()
    assert not re.search(r"<th[^>]*></th>", page.read_text(encoding="utf-8"))


@pytest.mark.slow
def test_the_page_is_among_the_outputs_and_leads_to_the_others(one):
    result, page, *_ = one
    assert str(page) in result.outputs
    links = {
        value for _, attributes in Tags(page.read_text()).found for value in [attributes.get("href")] if value
    }
    wanted = {"./" + Path(path).relative_to(page.parent).as_posix() for path in result.outputs} - {
        f"./{page.name}"
    }
    assert wanted <= links


@pytest.mark.sample(1)
def test_hostile_names_are_text(one):
    result, _, _, make = one
    said = Finding("FIL001", HOSTILE, HOSTILE, help=HOSTILE)
    seen = Tags(
        make(
            replace(result, robot=HOSTILE.replace("\x1b", ""), findings=(said,)), {HOSTILE: HOSTILE}
        ).decode()
    )
    assert seen.tags.count("script") == 1  # that of the tables
    assert seen.tags.count("img") == 1  # the picture
    assert not any(name.startswith("on") for name in seen.attributes)
    assert seen.open == []


@pytest.mark.slow
def test_it_opens_without_network_and_without_a_script(window, one):
    _, page, *_ = one
    for scheme in ("light", "dark"):
        shown = window(page, color_scheme=scheme)
        assert shown.requests[0] == page.as_uri()
        assert all(url.startswith("data:image/svg") for url in shown.requests[1:])
        assert shown.complaints == []
        size = shown.page.eval_on_selector(".drawn img", "one => [one.naturalWidth, one.alt.length]")
        assert min(size) > 20
        drawn = shown.pixels(".drawn")
        assert drawn.std() > 10
        assert (drawn[3:9, 3:9].mean() > 240) == (scheme == "light")
    narrow = window(page, viewport={"width": 390, "height": 800}, color_scheme="dark", bypass_csp=True)
    assert narrow.page.evaluate("document.documentElement.scrollWidth") <= 390
    assert narrow.violations() == []


def test_a_map_of_what_is_out_of_reach(tmp_path):
    far = replace(MAP, ranges_mm=((9000.0, 9500.0), (0.0,), (500.0,)), page=tmp_path / "far.html")
    mapped = map_workspace(far)
    assert mapped.exit == 3
    text = (tmp_path / "far.html").read_text()
    assert "No cell is in reach." in text
    assert "<img" not in text


@pytest.mark.parametrize("name", ["loads.csv", "new.yaml"])
def test_a_page_replaces_neither_an_input_nor_another_result(tmp_path, name):
    data = tmp_path / "loads.csv"
    data.write_bytes((SAMPLES / "kr270_campaign" / "loads.csv").read_bytes())
    before = data.read_bytes()
    request = IdentifyRequest(
        (data,), effects=("joint_compliance",), output=tmp_path / "new.yaml", page=tmp_path / name
    )
    with pytest.raises(Refusal, match="FIL007"):
        identify(request)
    with pytest.raises(Refusal, match="FIL007"):
        diagnose_robot(DiagnoseRequest((data,), output=tmp_path / "new.yaml", page=tmp_path / name))
    assert data.read_bytes() == before
    assert not (tmp_path / "new.yaml").exists()
