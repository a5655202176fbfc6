"""What a page is made of: figures that are those of the result, nothing lost where motions are left out, text that
stays text."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote, urljoin, urlsplit

import numpy as np
import pytest
from conftest import CELL, LINES
from hypothesis import given
from hypothesis import strategies as st

from postproc.base.document import Document, Edit, Span, apply
from postproc.base.findings import Finding
from postproc.base.geometry import Poses
from postproc.compensation.correct import MotionOutcome, correct
from postproc.compensation.subdivision import Subdivision
from postproc.report.page import FOLDER, embedded, finding_rows, linked, program_page
from postproc.report.page_data import WorstPlace, page_data, source_texts
from postproc.report.page_listing import AROUND, WHOLE, lines_to_list
from postproc.report.page_rows import SHOWN, rows_to_draw, worst_rows
from postproc.report.page_words import badge, program_verdict, reasons
from postproc.report.report import Spread
from postproc.toolpath import Arcs, Role
from postproc.workflows.preparation import Request, prepare
from postproc.workflows.program import compensate, predict

MM = 1e-3


def written(folder, lines=LINES, **request):
    """A compensated program and its page."""
    (folder / "cell.yaml").write_text(CELL)
    (folder / "part.src").write_text("\n".join(lines) + "\n")
    report = compensate(Request(folder / "part.src", force="", no_insert=True, **request))
    return report, (folder / "compensated" / "part.report.html").read_text(encoding="utf-8")


def columns(page):
    """The figures in a page as arrays, and what else its script is given."""
    given_ = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)[1])
    found = {}
    for name, one in given_["columns"].items():
        values = np.frombuffer(base64.b64decode(one["base64"]), dtype=f"<{one['form']}")
        found[name] = values.reshape(-1, one["wide"]) if one["wide"] > 1 else values
    return found, given_


@pytest.fixture(scope="module")
def predicted(tmp_path_factory):
    """Task, result and report of a prediction, with which a page can be made of any arrays."""
    return prediction(tmp_path_factory.mktemp("predicted"), LINES)


def prediction(folder, lines):
    (folder / "cell.yaml").write_text(CELL + "force_ci95: 0.1\n")
    (folder / "part.src").write_text("\n".join(lines) + "\n")
    request = Request(folder / "part.src", force="", report=folder / "out")
    ready = prepare(request)
    result = correct(replace(ready.task, gain=0.0))
    report = predict(request)
    return SimpleNamespace(
        folder=folder, task=ready.task, result=result, report=report, documents=ready.program.documents
    )


@pytest.fixture(scope="module")
def data(predicted):
    return page_data(predicted.task, predicted.result, predicted.report, predicted.documents)


def many(n, rng):
    """Figures of n motions, and which of them are shown in figures of so many."""
    figures = SimpleNamespace(
        cut=np.repeat(np.arange(-(-n // 97)), 97)[:n],
        before=rng.random(n),
        after=rng.random(n),
        between=np.where(rng.random(n) < 0.5, rng.random(n), np.nan),
        correction=rng.normal(size=(n, 3)),
    )
    size = np.linalg.norm(figures.correction, axis=1)
    quantities = [(1, figures.before), (-1, figures.before), (1, figures.after), (-1, figures.after)]
    quantities += [(1, figures.between), (1, size)]

    def shown(limit):
        return rows_to_draw(n, [n // 3], figures.cut[1:] != figures.cut[:-1], quantities, limit)

    return figures, shown


# Figures.


def test_the_page_shows_the_figures_of_the_corrections(tmp_path):
    report, page = written(tmp_path)
    found, given_ = columns(page)
    with open(tmp_path / "compensated" / "part.corrections.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert given_["motions"] == len(rows) == len(found["line"]) == report.motions
    assert found["line"].tolist() == [int(row["line"]) for row in rows]
    assert [given_["kinds"][k] for k in found["kind"]] == [row["kind"] for row in rows]
    assert (found["state"] == MotionOutcome.CORRECTED).sum() == report.corrected == 5

    def column(*names):
        return np.array([[float(row[name] or "nan") for name in names] for row in rows])

    cutting = found["state"] != MotionOutcome.AIR
    for name, names in (
        ("before", ["error_before_mm"]),
        ("after", ["error_after_mm"]),
        ("correction", [f"correction_{c}_mm" for c in "xyz"]),
    ):
        got, want = found[name].reshape(len(rows), -1)[cutting], column(*names)[cutting]
        np.testing.assert_allclose(got, want, atol=1e-6, rtol=1e-6)
    # in the robot base: base 1 of the cell is only shifted
    known = np.isfinite(column("x_mm")[:, 0])
    wanted = column("x_mm", "y_mm", "z_mm")[known] + [1500, -200, 600]
    np.testing.assert_allclose(found["position"][known], wanted, atol=1e-3)
    np.testing.assert_allclose(
        found["deflection"][cutting], column(*(f"deflection_{c}_mm" for c in "xyz"))[cutting], atol=1e-6
    )
    np.testing.assert_allclose(
        np.linalg.norm(found["deflection"], axis=1)[cutting], found["before"][cutting], rtol=1e-5
    )
    np.testing.assert_allclose(found["force"], column("fx_n", "fy_n", "fz_n"), atol=1e-3)


def test_the_length_of_the_path_is_that_of_the_cuts(tmp_path):
    _, page = written(tmp_path)
    found, _ = columns(page)
    # 100 + 100 + 150 + 150 mm and 50 mm, where the first step goes 2 mm down as well
    steps = np.diff(found["path_length"], prepend=0.0)
    lines = dict(zip(found["line"].tolist(), steps.tolist(), strict=True))
    assert lines[10] == pytest.approx(np.hypot(100, 2), abs=1e-3)
    assert [lines[line] for line in (11, 12, 13, 19)] == pytest.approx([100, 150, 150, 50], abs=1e-3)
    assert found["path_length"][-1] == pytest.approx(np.hypot(100, 2) + 450, abs=1e-3)


def test_the_band_is_the_doubt(predicted, data):
    doubt = predicted.report.uncertainty
    assert len(doubt.rows) > 3
    np.testing.assert_allclose(data.widths[doubt.rows], doubt.expanded / MM, rtol=1e-12)
    assert np.isnan(data.widths[predicted.result.state == MotionOutcome.AIR]).all()


def test_a_band_between_motions_that_were_evaluated_is_interpolated(predicted):
    doubt = predicted.report.uncertainty
    first, last = doubt.rows[0], doubt.rows[3]
    few = replace(doubt, rows=np.array([first, last]), expanded=np.array([[1e-5, 5e-5], [4e-5, np.nan]]))
    report = replace(predicted.report, uncertainty=few)
    data = page_data(predicted.task, predicted.result, report, predicted.documents)
    middle = first + 1
    assert data.rows.tolist() == list(range(data.motions))
    share = 1 / (last - first)
    assert data.widths[middle].tolist() == pytest.approx([0.01 + share * 0.03, 0.05])
    assert data.evaluated == 2


def test_inserted_motions_and_the_way_belong_to_their_motion(predicted):
    n = len(predicted.task.toolpath)
    cutting = np.flatnonzero(predicted.result.state != MotionOutcome.AIR)
    source = np.sort(np.concatenate([np.arange(n), [cutting[1], cutting[1], cutting[2]]]))
    last = np.append(source[1:] != source[:-1], True)
    role = np.where(last, Role.ORIGINAL, Role.INTERMEDIATE)
    nowhere = np.full((len(source), 3), np.nan)
    division = Subdivision(
        source, role, np.ones(len(source)), Poses(np.tile(np.eye(3), (len(source), 1, 1)), nowhere),
        nowhere, nowhere, nowhere[:, 0], np.ones(len(source), bool),
    )  # fmt: skip
    between = np.full(len(source), np.nan)
    between[source == cutting[1]] = [1e-6, 7e-6, 3e-6]
    output = SimpleNamespace(edits=(), division=division, path_error=between)
    data = page_data(predicted.task, predicted.result, predicted.report, predicted.documents, output)
    assert data.inserted.sum() == 3
    assert data.inserted[cutting[[1, 2]]].tolist() == [2, 1]
    assert data.path_error[cutting[1]] == pytest.approx(7e-3)
    assert np.isnan(np.delete(data.path_error, cutting[1])).all()


def test_arcs_are_drawn_by_points_on_them(predicted):
    """A quarter of a circle of 100 mm about the end point before, in the plane of the base."""
    task, row = predicted.task, int(np.flatnonzero(predicted.result.state != MotionOutcome.AIR)[2])
    ways, position = task.desired_path, np.zeros((len(task.toolpath), 3))
    begin, end = ways.start[[row]].position[0], ways.end[[row]].position[0]
    middle, half = 0.5 * (begin + end), 0.5 * np.linalg.norm(end - begin)
    base = task.base[row]
    centre, normal, sweep = position * np.nan, position * np.nan, position[:, 0] * np.nan
    centre[row] = (base.inverse() @ Poses(np.eye(3), middle)).position
    normal[row], sweep[row] = base.rotation.T @ [0, 0, 1], np.pi
    path = replace(task.toolpath, arcs=Arcs(centre, normal, sweep))
    bent = replace(task)
    bent.__dict__["desired_path"] = replace(ways, path=path)
    data = page_data(bent, predicted.result, predicted.report, predicted.documents)
    assert data.arcs.tolist() == [row]
    np.testing.assert_allclose(np.linalg.norm(data.arc_points[0] - middle / MM, axis=1), half / MM, rtol=1e-9)
    found, given_ = columns(program_page(data, {}).decode())
    assert found["arc"].tolist() == [row]
    assert found["arc_points"].shape == (given_["each"], 3)
    np.testing.assert_allclose(found["arc_points"], data.arc_points[0], rtol=1e-6)


# Many motions.


@pytest.mark.parametrize("n", [2, 999, 1000, 1001, 5000, 23_456])
def test_no_extreme_is_left_out(n):
    figures, shown = many(n, np.random.default_rng(n))
    rows = shown(1000)
    assert len(rows) <= 1000
    assert (np.diff(rows) > 0).all()
    assert {0, n - 1, n // 3} <= set(rows.tolist())
    if n <= 1000:
        assert len(rows) == n
        return
    for values in (figures.before, -figures.before, figures.after, -figures.after, figures.between):
        assert int(np.nanargmax(values)) in rows
    assert int(np.argmax(np.linalg.norm(figures.correction, axis=1))) in rows
    # and of every twentieth of the program its own
    for part in np.array_split(np.arange(n), 20):
        own = np.intersect1d(rows, part)
        assert figures.before[own].max() >= np.quantile(figures.before[part], 0.9)
        assert len(own) > 20


def test_the_shape_stays_where_motions_are_left_out():
    """A circle of many motions is still one: no chord takes more than a few degrees."""
    n = 20_000
    assert np.diff(many(n, np.random.default_rng(1))[1](2000)).max() <= 2 * n / 1000


def test_where_many_motions_are_left_out_the_columns_are_those_of_the_shown(tmp_path):
    at = LINES.index(";FORCE OFF")
    more = [f"LIN {{X {400 + k % 7}, Y {k}}}" for k in range(300)]
    long = prediction(tmp_path, [*LINES[:at], *more, *LINES[at:]])
    n, task = len(long.task.toolpath), replace(long.task)
    sweep = np.where(np.arange(n) % 3 == 0, 0.5, np.nan)
    round_ = np.where(np.isfinite(sweep)[:, None], [0.0, 0.0, 1.0], np.nan)
    path = replace(task.toolpath, arcs=Arcs(round_, round_, sweep))
    task.__dict__["desired_path"] = replace(long.task.desired_path, path=path)
    every, few = (
        page_data(task, long.result, long.report, long.documents, limit=limit) for limit in (n, 100)
    )
    assert few.motions == every.motions == len(every.rows) == n
    assert 50 < len(few.rows) <= 100 < n
    assert {0, n - 1, *every.rows[[place.row for place in every.places]].tolist()} <= set(few.rows.tolist())
    for name in (
        "line",
        "kind",
        "state",
        "cut",
        "path_length",
        "position",
        "force",
        "deflection",
        "correction",
    ):
        np.testing.assert_array_equal(getattr(few, name), getattr(every, name)[few.rows], name)
    for name in ("before", "after", "path_error", "inserted", "widths"):
        np.testing.assert_array_equal(getattr(few, name), getattr(every, name)[few.rows], name)
    assert [few.line[place.row] for place in few.places] == [every.line[place.row] for place in every.places]
    assert [place.source for place in few.places] == [place.source for place in every.places]
    # an arc is drawn where its begin is shown as well
    rows = few.rows[few.arcs]
    assert 5 < len(rows) < len(every.arcs)
    assert (few.rows[few.arcs - 1] == rows - 1).all()
    assert set(rows) == {row for row in every.rows[every.arcs] if {row - 1, row} <= set(few.rows)}
    np.testing.assert_array_equal(few.arc_points, every.arc_points[np.isin(every.rows[every.arcs], rows)])


def test_the_worst_are_the_largest_then_the_largest_of_each_cut_then_the_next():
    before = np.array([np.nan, 1, 5, 5, 2, np.nan, 4, 3, np.nan, np.inf, 4])
    after = np.array([np.nan, 0, 0, 0, 1, np.nan, 0, 0, np.nan, 0, 0])
    cut = np.array([-1, 0, 0, 0, 0, -1, 1, 1, -1, 2, 2], np.int32)
    result = SimpleNamespace(before=before, after=after, cut=cut)
    between = np.where(np.arange(11) == 7, 0.5, np.nan)
    rows = worst_rows(result, cut >= 0, between, True)
    assert [row for row, _ in rows] == [2, 4, 7, 6, 10, 3, 1]
    assert [why for _, why in rows[:5]] == [
        "largest before", "largest after", "largest path error between points after", "largest of cut 2",
        "largest of cut 3",
    ]  # fmt: skip
    assert [why for _, why in worst_rows(result, cut >= 0, between, False)[:1]] == ["largest before"]
    assert worst_rows(result, cut >= 9, between, True) == []


def test_a_page_of_many_motions_is_not_too_large(data):
    n, rng = 300_000, np.random.default_rng(2)
    figures, shown = many(n, rng)
    rows = shown(SHOWN)
    nothing, vectors = np.zeros(len(rows)), rng.normal(size=(len(rows), 3))
    big = replace(
        data, corrected=True, motions=n, rows=rows, line=rows + 10, kind=np.full(len(rows), 2),
        state=np.full(len(rows), int(MotionOutcome.CORRECTED)),
        cut=figures.cut[rows], path_length=rows / 1e3, position=vectors,
        arcs=np.zeros(0, np.int64), arc_points=np.zeros((0, 3, 3)), force=vectors, deflection=vectors,
        correction=figures.correction[rows], before=figures.before[rows], after=figures.after[rows],
        path_error=figures.between[rows], inserted=nothing.astype(int), widths=np.zeros((len(rows), 2)),
        places=(WorstPlace(int(np.searchsorted(rows, n // 3)), "", "LIN", ("LIN",)),),
    )  # fmt: skip
    page = program_page(big, {})
    assert len(page) < 15e6
    found, given_ = columns(page.decode())
    assert given_["motions"] == n
    assert given_["places"] == [n // 3]
    assert found["row"].tolist() == rows.tolist()
    np.testing.assert_allclose(found["before"], figures.before[rows], rtol=1e-6)
    assert f"{len(rows)} of 300000 motions" in page.decode()


# Text.


def test_the_lines_before_and_after_are_those_of_the_files(tmp_path):
    report, page = written(tmp_path)
    before = (tmp_path / "part.src").read_text().splitlines()
    after = (tmp_path / "compensated" / "part.src").read_text().splitlines()
    places, listing = page.split('id="listing"')
    old = [_plain(text) for text in re.findall(r'<code class="old">(.*?)</code>', places)]
    new = [_plain(text) for text in re.findall(r'<code class="new">(.*?)</code>', places)]
    assert len(old) == len(new) == 5
    for one, other in zip(old, new, strict=True):
        assert after[before.index(one) + 1] == other  # one line more: the mark
    assert report.corrected == 5
    # the program in the page: without what is new it is that before, without what is old that after
    shown = re.findall(r'<code class="(old|new|same)">(.*?)</code>', listing)
    assert [_plain(text) for kind, text in shown if kind != "new"] == before
    assert [_plain(text) for kind, text in shown if kind != "old"] == after
    assert sum(kind == "old" for kind, _ in shown) > 5  # and the air moves around them
    assert re.findall(r'<li id="L(\d+)">', listing) == [str(k + 1) for k in range(len(before))]


def test_of_a_long_program_the_lines_are_listed_that_are_spoken_of():
    assert lines_to_list(WHOLE, []) == list(range(1, WHOLE + 1))
    few = lines_to_list(WHOLE + 1, [5, 2000, 2010])
    assert few == [*range(1, 5 + AROUND + 1), *range(2000 - AROUND, 2010 + AROUND + 1)]
    assert len(lines_to_list(10**6, range(1, 10**6, 100))) <= WHOLE
    assert lines_to_list(10**6, [10**6])[-1] == 10**6


@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_texts_of_lines(end):
    raw = end.join([b"DEF a()", b"LIN A\xfc 1", b"\tLIN B 2", b"END"])
    document = Document(Path("a.src"), raw)
    at = raw.index(b"LIN A")
    edits = [
        Edit(Span(0, at, at), b"LIN NEW" + end),
        Edit(Span(0, raw.index(b"1"), raw.index(b"1") + 1), b"1.5"),
        Edit(Span(1, at, at + 3), b"another file"),
        Edit(Span(0, len(raw), len(raw)), b"!"),
    ]
    assert apply(document, [edit for edit in edits if edit.span.file == 0]).count(b"NEW") == 1
    told = source_texts(document, [2, 3, 4, 0, 9], edits)
    assert told[0] == ("LIN Aü 1", ("LIN NEW", "LIN Aü 1.5"))
    assert told[1] == ("    LIN B 2", ("    LIN B 2",))
    assert told[3] == told[4] == ("", ())


def test_a_motion_of_many_parts_is_told_by_its_last():
    document = Document(Path("a.src"), b"LIN A\n")
    edits = [Edit(Span(0, 0, 0), b"".join(b"LIN %d\n" % k for k in range(9)))]
    told = source_texts(document, [1], edits)[0][1]
    assert told[0] == "5 more lines, then"
    assert told[-1] == "LIN A"


@given(st.text())
def test_data_in_a_page_is_no_markup_and_is_what_it_was(text):
    held = str(embedded({"x": text}))
    assert not re.search("[<>&\u2028\u2029]", held)
    assert json.loads(held) == {"x": text}


@pytest.mark.parametrize(
    "name",
    [
        "a b.src",
        "100%.src",
        "a#b?c.src",
        "javascript:alert(1).src",
        'it\'s "<b>".src',
        "../up/x.src",
        "ü.src",
    ],
)
def test_a_link_leads_to_its_file(name):
    [(word, shown, address)] = linked({"file": name})
    assert word == "file"
    assert shown == name
    parts = urlsplit(urljoin("file:///jobs/out/x.html", address))
    assert parts.scheme == "file"
    assert (parts.query, parts.fragment) == ("", "")
    assert (
        unquote(parts.path) == urljoin("/jobs/out/", name) if name.startswith("..") else "/jobs/out/" + name
    )


HOSTILE = (
    "</script></style></code>\"'><script>alert(1)</script><img src=x onerror=alert(1)>&amp;\x1b[31m\u2028"
)


def test_hostile_text_is_text_wherever_it_stands(data):
    report = replace(
        data.report,
        program=f"/a/{HOSTILE.replace('/', '|')}",
        robot=HOSTILE,
        force_source=HOSTILE,
        model={HOSTILE: {"option": HOSTILE, "parameters": {HOSTILE: {
            "value": 1.0, "unit": HOSTILE, "interval": 0.1, "level": HOSTILE, "source": HOSTILE}}}},
        digests={HOSTILE: HOSTILE},
        findings=(Finding("COR003", HOSTILE, HOSTILE, 3, help=HOSTILE),),
    )  # fmt: skip
    places = (WorstPlace(data.places[0].row, HOSTILE, HOSTILE, (HOSTILE,)),)
    hostile = replace(data, report=report, places=places, corrected=True)
    page = program_page(hostile, {HOSTILE: HOSTILE}).decode()
    seen = Tags(page)
    assert seen.tags.count("script") == 2  # the data and the script of the page
    assert seen.tags.count("style") == 1
    assert "img" not in seen.tags
    assert not any(name.startswith("on") for name in seen.attributes)
    assert seen.text.count("<script>alert(1)") > 8
    assert "\x1b" not in page


def test_a_file_name_that_is_no_text_makes_a_page(data):
    report = replace(
        data.report, program="/a/\udcff.src", findings=(Finding("COR003", "x", "\udcff.src", 3),)
    )
    assert b"?.src" in program_page(replace(data, report=report), {"file": "\udcff.diff"})


# The page.


def test_a_page_is_well_formed_and_can_be_read_aloud(tmp_path):
    _, page = written(tmp_path)
    seen = Tags(page)
    assert seen.open == []
    assert len(set(seen.ids)) == len(seen.ids)
    for name in ("for", "aria-labelledby", "aria-describedby"):
        for value in seen.values(name):
            assert value in seen.ids, (name, value)
    regions = []
    for tag, attributes in seen.found:
        if tag == "canvas" and attributes.get("aria-hidden") != "true":
            assert attributes["aria-label"]
            assert attributes["tabindex"] == "0"
        if attributes.get("role") == "region":
            regions.append(attributes["aria-label"])
        if tag == "html":
            assert attributes["lang"] == "en"
        if tag == "th":
            assert attributes["scope"]
    assert len(set(regions)) == len(regions) >= 2
    levels = [int(tag[1]) for tag in seen.tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert set(levels[1:]) == {2}


def test_the_policy_names_this_script_and_this_style_and_nothing_else(tmp_path):
    _, page = written(tmp_path)
    policy = re.search(r'http-equiv="Content-Security-Policy" content="(.*?)"', page)[1].replace("&#39;", "'")
    for tag in ("script", "style"):
        content = re.search(rf"<{tag}>(.*?)</{tag}>", page, re.S)[1]
        digest = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in policy
    assert "default-src 'none'" in policy
    assert not re.search(r"""(?:src|href|url)\s*[=(]\s*["']?(?:https?:)?//""", page)
    assert " style=" not in page


def test_the_same_job_makes_the_same_page(tmp_path):
    first = written(tmp_path)[1]
    assert written(tmp_path)[1] == first


def test_a_prediction_has_a_page(predicted):
    page = (predicted.folder / "out" / "part.prediction.html").read_text(encoding="utf-8")
    assert "nothing was changed" in page
    assert 'id="correction"' not in page
    assert not columns(page)[1]["corrected"]
    assert str(predicted.folder / "out" / "part.prediction.html") in predicted.report.outputs


def test_viridis_rises_in_lightness():
    """So that the scale can be read without telling red from green, and on paper without colour."""
    text = (FOLDER / "canvas.js").read_text()
    colours = re.findall(r"'#([0-9a-f]{6})'", text[text.index("VIRIDIS = [") :].partition("];")[0])
    channels = np.array([[int(c[i : i + 2], 16) / 255 for i in (0, 2, 4)] for c in colours])
    light = channels**2.2 @ [0.2126, 0.7152, 0.0722]
    assert len(colours) == 11
    assert (np.diff(np.cbrt(light)) > 0.03).all()


# Words.


def _told(data, **changes):
    report = replace(data.report, **changes)
    return program_verdict(replace(data, report=report, corrected=True))


def test_verdicts(data):
    length = Spread(1.5e-3, 1e-3, 1.4e-3)
    small = Spread(1e-6, 1e-6, 1e-6)
    done = {
        "cutting": 5,
        "corrected": 5,
        "before": length,
        "after": small,
        "path_error": small,
        "inserted": 0,
    }
    assert _told(data, **done).startswith(
        "Every cutting motion is corrected: the largest predicted error falls from"
    )
    assert "1.500 mm" in _told(data, **done)
    assert "to 0.0010 mm" in _told(data, **done)
    assert _told(data, **{**done, "corrected": 3}).startswith("3 of 5 cutting motions are corrected")
    assert "Nothing was corrected" in _told(data, **{**done, "corrected": 0})
    assert "2 motions were inserted" in _told(data, **{**done, "inserted": 2})
    assert "50% of the correction" in _told(data, **{**done, "gain": 0.5})
    nothing = Spread(np.nan, np.nan, np.nan)
    assert "no deflection" in _told(data, **{**done, "before": nothing})
    assert "(95 %)" in _told(data, **done)
    unknown = replace(data.report.uncertainty, before=np.nan, after=np.nan)
    assert "95 %" not in _told(data, **{**done, "uncertainty": unknown})


def test_what_was_left_is_told_with_its_reason(tmp_path):
    lines = [*LINES[:11], ";COMPENSATE OFF", *LINES[11:]]
    lines.insert(lines.index("LIN {X 400.000}"), ";COMPENSATE ON")
    report, page = written(tmp_path, lines)
    assert (report.cutting, report.corrected) == (5, 1)
    left = re.search(r'<details class="uncorrected".*?</details>', page, re.S)[0]
    assert "is not corrected" in left
    assert "between COMPENSATE OFF and ON" in left
    assert "1 of 5 cutting motions are corrected" in page


def test_left_cuts_beyond_some_are_counted(data):
    findings = tuple(Finding("COR003", f"cut {k}", "a", k) for k in range(1, 30))
    told = reasons(replace(data, corrected=True, report=replace(data.report, findings=findings)))
    assert told[0] == "cut 1"
    assert told[-1] == "and 21 more cuts, see the findings"


def test_badges_are_more_than_colours():
    several = [badge(0, 5), badge(0, 0), badge(3, 5), badge(1, 0)]
    assert len({sign for _, sign, _ in several}) == len({word for _, _, word in several}) == 4


def test_findings_the_gravest_first_and_not_without_end():
    findings = [Finding("COR006", str(k), "a.src", k) for k in range(400)]
    findings.append(Finding("FIL001", "unreadable", "b.src"))
    rows = finding_rows(findings)
    assert rows[0]["code"] == "FIL001"
    assert len(rows) == 300


class Tags(HTMLParser):
    """Tags, attributes and text of a page; ``open``: what was not closed."""

    EMPTY = ("meta", "link", "input", "img", "br")

    def __init__(self, page):
        super().__init__()
        self.found, self.open, self.parts = [], [], []
        self.feed(page)
        self.close()
        self.tags = [tag for tag, _ in self.found]
        self.attributes = [name for _, attributes in self.found for name in attributes]
        self.ids = list(self.values("id"))
        self.text = "".join(self.parts)

    def values(self, name):
        return [attributes[name] for _, attributes in self.found if name in attributes]

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open, tag
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.parts.append(data)


def _plain(text):
    stream = io.StringIO()
    stream.write(Tags(f"<p>{text}</p>").text)
    return stream.getvalue()
