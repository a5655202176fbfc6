"""Force and place of ``verify`` against a scan over all places, and the path as a controller runs it."""

from dataclasses import replace

import numpy as np
import pytest
from path_cases import circle, corner, line, task
from test_verify import as_run, bend, simulated

from postproc.base.geometry import rotation_from_vector, turn_between
from postproc.base.units import MM
from postproc.process import Wrenches
from postproc.toolpath import Configuration
from postproc.verification.differences import in_air, on_cuts
from postproc.verification.pairing import Different, pair_motions
from postproc.verification.run_path import RunPath
from postproc.verification.simulator import Simulator

STEEP = np.array([-2000.0, 900.0, 1500.0, 0.0, 0.0, 0.0])


def varying(start, end, points=None):
    """A path under a force that goes from ``start`` to ``end`` on its last motion."""
    points = points or [[1.6, -0.1, 0.6], [1.6, -0.1, 0.5], [1.6, 0.0, 0.5], [1.6, 0.1, 0.5], [1.6, 0.1, 0.6]]
    cutting = [False, False, True, True, False]
    made = task(points, cutting, wrench=np.zeros(6))
    values, begin = np.zeros((5, 6)), np.zeros((5, 6))
    values[2], begin[2], values[3], begin[3] = start, start, end, start
    return replace(made, force=Wrenches(values, begin, np.array(cutting), "test", (), np.zeros(5, bool)))


def scanned(original, run, motion, share, around, window=15 * MM, step=0.01 * MM):
    """(place [m] along the cut, error (3,)): of places on a fine grid that near the one at which the tool, under the
    force of that place, is nearest to the path, by halving the grid about it."""
    ways, rows = original.desired_path, np.flatnonzero(original.carries)
    ends = np.cumsum(ways.length[rows])
    path = RunPath.of(original)
    command = RunPath.of(run).at(np.array([motion]), np.array([share]))

    def at(places):
        number = np.minimum(np.searchsorted(ends, places, side="left"), len(rows) - 1)
        along = (places - ends[number] + ways.length[rows][number]) / ways.length[rows][number]
        return rows[number], np.clip(along, 0.0, 1.0)

    def error(places):
        row, along = at(places)
        many = command[np.zeros(len(places), int)]
        real = run.simulated(np.full(len(places), motion), many, original.force.along(row, along))
        goal = path.at(row, along)
        off = real.pose.position - goal.position
        return off, np.sum(off * path.tangent(row, along), axis=1)

    low, high = max(around - window, 0.0), min(around + window, ends[-1])
    places = np.linspace(low, high, int((high - low) / step) + 2)
    off, ahead = error(places)
    found = np.flatnonzero((ahead[:-1] > 0) & (ahead[1:] <= 0))
    if not len(found):  # pushed out over an end of the cut
        end = 0.0 if ahead[0] <= 0 else ends[-1]
        return end, error(np.array([end]))[0][0]
    distance = np.linalg.norm(off[found], axis=1)
    one, two = places[found[np.argmin(distance)]], places[found[np.argmin(distance)] + 1]
    for _ in range(40):
        middle = 0.5 * (one + two)
        off, ahead = error(np.array([middle]))
        one, two = (middle, two) if ahead[0] > 0 else (one, middle)
    return middle, off[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    "original",
    [
        line(length=0.1),
        bend(),
        varying(0.2 * STEEP, STEEP),
        varying(STEEP, 0.1 * STEEP),
        varying(-STEEP, STEEP),
        circle(diameter=0.1),
    ],
    ids=["line", "bend", "rising", "falling", "turning", "circle"],
)
@pytest.mark.parametrize("corrected", [False, True])
def test_place_and_force_are_those_of_a_scan(original, corrected):
    run = as_run(original, gain=0.7)[0] if corrected else original
    before, after = simulated(original, run)
    found = after if corrected else before
    assert found.converged
    samples = found.samples
    inside = np.flatnonzero((samples.share > 0.02) & (samples.share < 0.98))
    for sample in inside[:: max(1, len(inside) // 6)]:
        motion, share = int(samples.motion[sample]), float(samples.share[sample])
        place, error = scanned(original, run, motion, share, samples.place.arc[sample])
        assert samples.place.arc[sample] == pytest.approx(place, abs=2e-7)
        np.testing.assert_allclose(samples.place.error[sample], error, atol=2e-7)


def test_where_a_force_steps_it_has_every_value_between():
    """A push along the feed that ends: the tool falls back to the vertex and stays until the command has come there."""
    original = varying(STEEP, 0.1 * STEEP)
    start = original.force.start[:].copy()
    start[3] = 0.1 * STEEP
    original = replace(
        original,
        force=Wrenches(original.force.values, start, original.carries, "test", (), np.zeros(5, bool)),
    )
    before, _ = simulated(original, original)
    samples = before.samples
    held = np.flatnonzero(np.abs(samples.place.arc - 0.1) < 1e-9)
    assert before.converged
    assert len(held) >= 1
    size = np.linalg.norm(STEEP)
    assert ((samples.place.force[held] < size) & (samples.place.force[held] > 0.1 * size)).all()
    assert (np.diff(samples.place.force[held]) < 0).all()
    for sample in held:  # the tool is at the vertex, and beside it alone
        assert samples.place.error[sample] @ [0.0, 1.0, 0.0] == pytest.approx(0.0, abs=2e-7)


def test_a_force_that_can_not_be_followed_gives_no_figure():
    original = line(length=0.1)
    far = replace(original, force=Wrenches(
        original.force.values * 3e4, original.force.values * 3e4, original.carries, "test", (), np.zeros(4, bool)
    ))  # fmt: skip
    simulator = Simulator.of(far, pair_motions(far, far))
    cuts = simulator.pairing.stretches
    found = simulator.run(far, cuts.start, cuts.stop)
    assert not found.converged
    assert np.isnan(found.largest)


def approximated(distance):
    made = bend()
    blend = np.array([0.0, 0.0, distance, 0.0, 0.0])
    return replace(made, toolpath=made.toolpath.with_columns(approximation=blend, stops=blend == 0.0))


def test_a_vertex_is_passed_on_the_parabola():
    """B(u) = (1 - u)^2 P + 2 u (1 - u) V + u^2 Q about the vertex V, from P to Q, 8 mm before and behind."""
    path = RunPath.of(approximated(8 * MM))
    vertex, length = np.array([1.6, 0.0, 0.5]), 0.1
    for u in np.linspace(0.0, 1.0, 21):
        along = (2 * u - 1) * 8 * MM
        row, share = (2, 1 + along / length) if along < 0 else (3, along / length)
        first, last = vertex - np.array([8 * MM, 0, 0]), vertex + np.array([0, 8 * MM, 0])
        place = (1 - u) ** 2 * first + 2 * u * (1 - u) * vertex + u**2 * last
        here = path.at(np.array([row]), np.array([share]))
        np.testing.assert_allclose(here.position[0], place, atol=1e-12)
        way = 2 * (1 - u) * (vertex - first) + 2 * u * (last - vertex)
        np.testing.assert_allclose(
            path.tangent(np.array([row]), np.array([share]))[0], way / np.linalg.norm(way), atol=1e-9
        )


def test_a_parabola_departs_from_its_vertex_as_said():
    made = approximated(8 * MM)
    rotation = made.wanted.rotation.copy()
    for row, turned in ((2, (0.01, 0.0, 0.02)), (3, (-0.02, 0.03, 0.02))):
        rotation[row] = rotation_from_vector(np.array([turned]))[0] @ rotation[row - 1]
    path = RunPath.of(replace(made, wanted=replace(made.wanted, rotation=rotation)))
    off, turn = path.departure(np.arange(5))
    here = path.at(np.array([3]), np.array([0.0]))
    assert off[3] == pytest.approx(np.linalg.norm(here.position[0] - [1.6, 0.0, 0.5]), abs=1e-12)
    by = np.linalg.norm(turn_between(rotation[2:3], here.rotation))
    assert by > 1e-4
    assert turn[3] == pytest.approx(by, rel=0.02)
    assert not np.delete(off, 3).any()
    assert not np.delete(turn, 3).any()


@pytest.mark.parametrize("distance", [0.0, 0.9 * MM])
def test_few_samples_show_what_many_do(distance):
    """Of motions that are shorter than the distance of the first samples, rounded and not."""
    turns = np.radians([0.0, 20.0, 30.0, 30.0, 80.0, 80.5, 81.0])
    points = np.cumsum(2 * MM * np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1), axis=0)
    points = np.pad(points, ((1, 0), (0, 0))) + np.array([1.6, 0.0, 0.5])
    made = task(points, [False] + [True] * 7)
    blend = np.array([0.0] + [distance] * 6 + [0.0])
    made = replace(made, toolpath=made.toolpath.with_columns(approximation=blend, stops=blend == 0.0))
    run, pairing = replace(made), pair_motions(made, made)
    simulator = Simulator.of(made, pairing)
    few, many = (simulator.run(run, pairing.start, pairing.stop, step) for step in (4 * MM, 0.02 * MM))
    assert len(few.samples.motion) < 0.2 * len(many.samples.motion)
    assert few.largest == pytest.approx(many.largest, abs=3e-7)
    assert few.samples.rms == pytest.approx(many.samples.rms, rel=0.02)


def test_a_vertex_is_passed_within_half_of_its_motions():
    assert RunPath.of(approximated(1.0)).reach[3] == pytest.approx(0.05)
    unknown = RunPath.of(approximated(np.nan))
    assert unknown.unknown[3]
    assert unknown.reach[3] == 0.0
    assert not RunPath.of(approximated(0.0)).reach.any()


def test_approximated_corners_are_compared_as_they_are_run():
    """What is left of the corner is what shorter motions make its parabola shorter, not all that it cuts off."""
    original = approximated(20 * MM)
    run = as_run(original)[0]
    _, after = simulated(original, run)
    assert after.largest < 0.6 * MM
    sharp = replace(run, toolpath=run.toolpath.with_columns(approximation=np.zeros(len(run.toolpath))))
    _, other = simulated(original, sharp)
    assert other.largest > 20 * MM / 4 * np.sqrt(2) * 0.9


def differing(original, run):
    pairing = pair_motions(original, run)
    simulator = Simulator.of(original, pairing)
    after = simulator.run(run, pairing.start, pairing.stop)
    return {one.what for one in (*on_cuts(simulator, run, after), *in_air(simulator, run, after))}


def test_a_program_differs_in_nothing_from_itself():
    for build in (line, bend, circle, corner):
        assert differing(build(), build()) == set()


@pytest.mark.parametrize(
    ("column", "row", "value", "what"),
    [
        ("feed", 2, 0.5, "the motion has another feed"),
        ("feed", 4, 0.5, "the motion has another feed"),
        ("approximation", 2, 0.0, "the motion stops where the original flows"),
        ("status", 4, 5, None),
    ],
)
def test_what_differs_is_told(column, row, value, what):
    original = approximated(5 * MM)
    feed = np.full(5, 0.02)
    original = replace(original, toolpath=original.toolpath.with_columns(feed=feed))
    stated = column in original.toolpath.configuration.numbers
    path = original.toolpath
    values = np.array(path.configuration[column] if stated else getattr(path, column))
    values[row] = value
    changes = {"configuration": Configuration({column: values})} if stated else {column: values}
    if column == "approximation":
        changes["stops"] = values == 0.0
    run = replace(original, toolpath=original.toolpath.with_columns(**changes))
    assert differing(original, run) == ({what} if what else set())


def test_another_tool_is_told():
    original = bend()
    tool = original.tool.copy()
    tool.position[3, 0] += 0.1 * MM
    assert "the motion has another base or tool" in differing(original, replace(original, tool=tool))


def test_a_point_in_air_is_where_it_was():
    original = bend()
    for row, allowed in ((0, False), (1, True), (4, False)):
        place = original.toolpath.position.copy()
        place[row, 2] += 0.3 * MM
        wanted = replace(original.wanted, position=place)
        moved = replace(original, wanted=wanted, toolpath=original.toolpath.with_columns(position=place))
        assert ("the air move has another end than in the original" in differing(original, moved)) != allowed


def test_motions_are_added_on_cuts_alone():
    original = bend()
    run = as_run(original)[0]
    assert len(run.toolpath) > len(original.toolpath)
    with pytest.raises(Different):
        pair_motions(run, original)
    air = replace(original, force=Wrenches.zero(5))
    with pytest.raises(Different, match="where the first has none"):
        pair_motions(air, run)
