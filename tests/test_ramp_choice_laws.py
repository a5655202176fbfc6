"""Which ramps of the force get fitted points, from what place to what place, and which of the fits is taken: the same
in loops over single ramps, for drawn programs; the fits themselves are drawn too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_cases import MM, corrected, output, spring, with_ramp

from postproc.compensation.ramp_fits import CLOSE_STARTS, FittedPoints
from postproc.compensation.ramp_points import NEVER, choose_ramp_points
from postproc.compensation.subdivision import Limits
from postproc.toolpath import EditConstraints, Role

COMPLIANCE = np.diag([2e-6, 3e-6, 1e-6])
ALLOWED = 10e-6
FITS, CLOSE = 5, len(CLOSE_STARTS)
SMALL, LARGE = 0.05, 1.0
"""Parts of a force of which a ramp's rounded end shows not, and does."""


class Drawn:
    """Lines of 8 to 84 mm in air (two) and under force, ramps at the starts of some; points are inserted where ramps
    end, and at other places."""

    def __init__(self, seed: int) -> None:
        chance = self.chance = np.random.default_rng(seed)
        n = self.n = 8
        size = chance.choice([8.0, 14.0, 40.0, 60.0], n, p=[0.15, 0.2, 0.35, 0.3]) * MM
        size *= chance.uniform(1.0, 1.4, n)
        heading = np.cumsum(chance.choice([0.0, 0.4, -1.2], n))
        step = size[:, None] * np.stack([np.cos(heading), np.sin(heading), 0.0 * heading], axis=1)
        points = np.cumsum(step, axis=0) - step[0]
        self.blend = chance.choice([0.0, 0.4, 1.0, 2.0, np.nan], n, p=[0.3, 0.25, 0.25, 0.15, 0.05]) * MM
        self.beside = chance.choice([0.3, 0.8, np.nan], n, p=[0.6, 0.35, 0.05]) * MM
        self.feed = chance.choice([np.nan, 0.02, 0.1], n)
        self.limits = Limits(max_growth=100.0, ramp_end=0.5 * MM, cycle=0.012)
        force = chance.choice([SMALL, LARGE, 1.5], n)[:, None] * chance.uniform(-300.0, 300.0, (n, 3))
        force[:2] = 0.0
        self.locked, self.no_insert = (
            dict.fromkeys(chance.choice(np.arange(2, n), count, replace=False).tolist(), "stays")
            for count in chance.choice([0, 0, 1], 2)
        )
        constraints = EditConstraints(
            locked=self.locked,
            no_insert_before=self.no_insert,
            inserted_approximation=self.beside,
            exact_stays=bool(chance.random() < 0.1),
        )
        job = spring(points, [False, False, *[True] * (n - 2)], COMPLIANCE, force, approximation=self.blend)
        path = replace(job.toolpath.with_columns(feed=self.feed), constraints=constraints)
        self.rows = np.flatnonzero(chance.random(n) < 0.6)
        self.rows = self.rows[self.rows > 2]
        self.long = chance.choice([3.0, 5.0, 8.0, 25.0], len(self.rows), p=[0.3, 0.3, 0.3, 0.1]) * MM
        steps = force[self.rows] - force[self.rows - 1]
        self.job = with_ramp(replace(job, toolpath=path), self.rows, steps, self.long)
        length = self.length = self.job.desired_path.length
        ends = dict(zip(self.rows.tolist(), self.long.tolist(), strict=True))
        self.inserted: dict[int, list[float]] = {row: [] for row in range(n)}
        for row in range(2, n):
            if ends.get(row, 1.0) < length[row] and chance.random() < 0.8:
                self.inserted[row].append(ends[row] / length[row] if row in ends else 0.5)
            more = chance.choice([0, 1, 2], p=[0.4, 0.4, 0.2])
            near = 1.0 + chance.choice([0.6, 1.1, 4.0], more) * MM / ends.get(row, 1.0)
            self.inserted[row] += (ends.get(row, 1.0) * near / length[row]).tolist() if row in ends else []
            self.inserted[row] += chance.uniform(0.6, 0.99, chance.choice([0, 1])).tolist()
            if row in ends:  # some before it
                before = chance.uniform(0.2, 0.8, chance.choice([0, 0, 1]))
                self.inserted[row] += (before * ends[row] / length[row]).tolist()
            self.inserted[row] = sorted(at for at in set(self.inserted[row]) if at < 0.995)
        self.shifts = np.array([self.shift(row, 1.0) for row in range(n)])
        places = [(row, at, self.shift(row, at), 0.0) for row in range(n) for at in self.inserted[row]]
        self.division = output(self.job, self.shifts, places)
        self.result = corrected(self.job, self.shifts)

    def shift(self, row: int, share: float) -> np.ndarray:
        """Of the command where the tool is on its path, against the force there."""
        wrench = self.job.force.along(np.array([row]), np.array([share]))[0, :3]
        return -COMPLIANCE @ wrench

    def motion(self, row: int, share: float) -> int:
        """The number of the motion of the output that ends there."""
        return sum(1 + len(self.inserted[k]) for k in range(row)) + self.inserted[row].index(share)

    def vertex(self, row: int) -> int:
        """The motion of the output that ends in the program's point."""
        return sum(1 + len(self.inserted[k]) for k in range(row + 1)) - 1

    def approximated(self, row: int, inserted: bool) -> float:
        constraints = self.job.toolpath.constraints
        if inserted and self.blend[row] == 0 and not constraints.exact_stays:
            return float(self.beside[row])
        return float(self.blend[row])

    def expected(self) -> list[dict]:
        """By row, in loops: the ramps whose points are fitted."""
        parts, found = self.job.force.ramps, []
        lists = {row: np.flatnonzero(parts.row == row) for row in range(self.n)}
        for row in range(3, self.n):
            if len(lists[row]) != 1:
                continue
            (k,) = lists[row]
            end, length = parts.length[k], self.length
            knots = [at for at in self.inserted[row] if abs(at - end / length[row]) < 1e-8]
            if parts.start[k] > 0 or end >= length[row] or not knots:
                continue
            if {row, row - 1} & {*self.locked, *self.no_insert}:
                continue
            before, after = self.approximated(row - 1, False), self.approximated(row, True)
            if not np.isfinite([before, after]).all() or after == 0:
                continue
            feed = max(np.nan_to_num(self.feed[row]), np.nan_to_num(self.feed[row - 1]))
            spacing = max(self.limits.ramp_end, feed * self.limits.cycle)
            here = [at * length[row] for at in self.inserted[row]]
            inner = sum(at <= end + 2 * spacing for at in here)
            beyond = min([length[row], *(at for at in here if at > end + 2 * spacing)]) - end
            taken = max((min(parts.length[j] - parts.start[j], parts.extent[j]) for j in lists[row - 1]),
                        default=0.0)  # fmt: skip
            others = [
                at * length[row - 1]
                for at in self.inserted[row - 1]
                if at * length[row - 1] > taken + 2 * spacing
            ]
            # before an exact vertex nothing is in the way but a point
            room = length[row - 1] - max([taken, *others]) if before > 0 or others else np.inf
            most = max(before, after)
            margin = min(3.0 * MM + 2 * most, 0.5 * min(room, 1e3), 0.5 * beyond)
            turn = self.shift(row, knots[0]) - self.shift(row - 1, 1.0)
            shows = 0.25 * most * np.linalg.norm(turn) / end > 0.9 * self.job.tolerance
            if margin < most + 2 * spacing or inner + shows < 2:
                continue
            vertex = self.vertex(row - 1)
            found.append(
                {"row": row, "vertex": vertex, "knot": self.motion(row, knots[0]), "end": end,
                 "exact": before == 0, "reach": (before, after), "spacing": (spacing, spacing),
                 "margin": (margin, margin), "after": vertex + inner + 1, "arc": (False, False)}
            )  # fmt: skip
        return found


SEEDS = range(60)


@pytest.mark.parametrize("first", SEEDS[::10])
def test_ramps_that_get_points_in_loops(first: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows, motions, distances and room of each."""
    seen = []

    def noted(ramps, curves, count, allowed, names):  # type: ignore[no-untyped-def]
        seen.append((count, ramps, curves))
        return {}

    monkeypatch.setattr("postproc.compensation.ramp_points.fit_ramps", noted)
    for seed in range(first, first + 10):
        drawn = Drawn(seed)
        seen.clear()
        part, chosen, left = choose_ramp_points(
            drawn.job, drawn.result, drawn.division, drawn.limits, {}, ALLOWED, np.empty(0, int), Fits({}, {})
        )  # type: ignore[arg-type]
        expected = drawn.expected()
        assert part is drawn.division
        assert chosen is None
        assert left.tolist() == [one["row"] for one in expected], seed
        if not expected:
            continue
        count, ramps, curves = seen[0]
        assert count == 1
        for name in expected[0]:
            np.testing.assert_allclose(
                getattr(ramps, name), [one[name] for one in expected], rtol=1e-9, atol=1e-9, err_msg=name
            )
        # the curves reach so far, and go on to the next points of the output
        last = curves.first + curves.step * (curves.place.shape[1] - 3)
        first_at = np.where(ramps.exact, 0.0, -ramps.margin[:, 0])
        np.testing.assert_allclose(curves.first, first_at, atol=4 * curves.step.max())
        np.testing.assert_allclose(last, ramps.end + ramps.margin[:, 1], atol=4 * curves.step.max())
        command = drawn.division.command
        before = np.where(ramps.exact, ramps.vertex, ramps.vertex - 1)
        np.testing.assert_allclose(curves.place[:, 0], command[before].position, atol=1e-12)
        np.testing.assert_allclose(curves.place[:, -1], command[ramps.after].position, atol=1e-12)


class Fits:
    """Fits whose errors are drawn: ``few`` (name, count), ``close`` (name, number): those of the first fits and of the
    close ones [m]; ``better`` what remains of one that is gone on with."""

    def __init__(self, few: dict, close: dict, better: dict | None = None) -> None:
        self.few, self.close, self.better = few, close, better or {}
        self.names: dict[int, int] = {}
        self.along: dict[float, np.ndarray] = {}

    def points(self, mark: float, exact: bool, count: int, largest: float) -> FittedPoints:
        """Recognised by ``mark``, the first number of each place."""
        chance = np.random.default_rng(int(mark))
        width = count if exact else count + 1
        own = int(chance.integers(width))
        along = np.sort(chance.uniform(-3.0, 6.0, width)) * MM
        along[chance.integers(width)] = along[own]  # too near
        place = np.zeros((width, 3))
        place[:, 0], place[:, 1] = mark, np.arange(width)
        self.along[mark] = np.append(along, own)
        return FittedPoints(place, along, own, largest)

    def fit_ramps(self, ramps, curves, count, allowed, names):  # type: ignore[no-untyped-def]
        found = {}
        for k, name in enumerate(names.tolist()):
            self.names[int(ramps.row[k])] = name
            mark = 1000.0 * ramps.row[k] + count
            found[name] = self.points(mark, bool(ramps.exact[k]), count, self.few[int(ramps.row[k]), count])
        return found

    def curve(self, place, build):  # type: ignore[no-untyped-def]
        return build()

    def go_on(self, ramp, curve, points, allowed):  # type: ignore[no-untyped-def]
        row, count = int(ramp.row[0]), len(points.along) - 1
        assert allowed < points.largest <= 1.08 * allowed
        better = self.better[row, count]
        return points if better >= points.largest else replace(points, largest=better)

    def fit(self, ramp, curve, number, allowed):  # type: ignore[no-untyped-def]
        row = int(ramp.row[0])
        largest = self.close.get((row, number))
        if largest is None:
            return None
        return self.points(1000.0 * row + 100 + number, False, len(CLOSE_STARTS[number][0]) - 1, largest)


def taken(one: dict, fits: Fits, fewest: int, most: int, anyhow: bool) -> float | None:
    """The mark of the fit that is taken for a ramp: the first that is within what is allowed, with at least ``fewest``
    and at most ``most`` points, else, where any will do, the nearest; more points have to pay."""
    row, nearest, least = one["row"], None, np.inf
    for count in range(max(fewest, 1), min(most, FITS) + 1):
        size = fits.few[row, count]
        if ALLOWED < size <= 1.08 * ALLOWED and not one["exact"]:
            size = min(size, fits.better[row, count])
        if size <= ALLOWED:
            return 1000.0 * row + count
        if size < 0.9 * least:
            nearest, least = 1000.0 * row + count, size
    for number in range(0 if one["exact"] else CLOSE):
        size, points = fits.close[row, number], len(CLOSE_STARTS[number][0]) - 1
        if size is None or not fewest <= points <= most:
            continue
        if size <= ALLOWED:
            return 1000.0 * row + 100 + number
        if size < 0.97 * least:
            nearest, least = 1000.0 * row + 100 + number, size
    return nearest if anyhow else None


@pytest.mark.parametrize("first", SEEDS[::10])
def test_the_fit_that_is_taken_in_loops(first: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of drawn errors; where the points are then, and which others of the output are gone."""
    sizes = np.array([0.7, 1.0, 1.03, 1.07, 1.2, 1.25, 1.3, 1.4, 1.45, 1.8, 2.0]) * ALLOWED
    for seed in range(first, first + 10):
        drawn, chance = Drawn(seed), np.random.default_rng(1000 + seed)
        expected = drawn.expected()
        low = chance.choice([0, 2, 4])  # many are not within what is allowed
        few = {(one["row"], k): chance.choice(sizes[low:]) for one in expected for k in range(1, FITS + 1)}
        better = {key: size * chance.choice([0.9, 0.98, 1.01]) for key, size in few.items()}
        close = {
            (one["row"], k): None if chance.random() < 0.2 else chance.choice(sizes[low:])
            for one in expected
            for k in range(CLOSE)
        }
        fits = Fits(few, close, better)
        monkeypatch.setattr("postproc.compensation.ramp_points.fit_ramps", fits.fit_ramps)
        anyhow = np.array([one["row"] for one in expected if chance.random() < 0.5], int)
        least, fewest = {}, {}
        for one in expected:
            row = one["row"]
            count = fewest[row] = int(chance.choice([0, 0, 2, 4, 5, NEVER]))
            at = float(drawn.division.share[one["knot"]])
            least[(row, at) if one["exact"] or chance.random() < 0.5 else (row - 1, 1.0)] = count
        spare = int(chance.choice([0, 1, 2, 5, 12]))
        limits = replace(drawn.limits, max_growth=1.0, least=drawn.division.inserted + spare)
        part, chosen, left = choose_ramp_points(
            drawn.job, drawn.result, drawn.division, limits, least, ALLOWED, anyhow, fits
        )  # type: ignore[arg-type]
        marks = {}
        for one in expected:
            row, inner = one["row"], one["after"] - one["vertex"] - 1
            if fewest[row] < NEVER:
                mark = taken(one, fits, fewest[row], inner + spare, row in anyhow)
                if mark is not None:
                    marks[row] = mark
        known = [one["row"] for one in expected if fewest[one["row"]] < NEVER]
        nothing_holds = [row for row in known if row not in marks]
        assert left.tolist() == [row for row in known if row in nothing_holds], seed
        if not marks:
            assert chosen is None
            assert part is drawn.division
            continue
        assert chosen is not None
        assert chosen.own_place is not None
        assert chosen.place is not None
        assert chosen.own_place[:, 0].tolist() == [marks[row] for row in sorted(marks)], seed
        # what is inserted instead, and where
        gone = set[int]()
        for number, one in enumerate(one for one in expected if one["row"] in marks):
            row = one["row"]
            *along, own = fits.along[marks[row]]
            own, along = int(own), np.array(along)
            kept = one["knot"] if one["exact"] else one["vertex"]
            gone |= {k for k in range(one["vertex"] + 1, one["after"]) if k != kept}
            assert part.source[chosen.corner[number]] == drawn.division.source[kept]
            assert part.share[chosen.corner[number]] == drawn.division.share[kept]
            assert chosen.own_place[number, 1] == own
            apart = 0.1 * min(one["spacing"])
            along[own] = one["end"] if one["exact"] else 0.0
            for k in range(own + 1, len(along)):
                along[k] = max(along[k], along[k - 1] + apart)
            for k in reversed(range(own)):
                along[k] = min(along[k], along[k + 1] - apart)
            mine = chosen.group == number
            others = np.delete(along, own)
            at = chosen.row[mine] - row + chosen.share[mine]
            np.testing.assert_array_equal(chosen.row[mine], np.where(others > 0, row, row - 1))
            on = np.where(others > 0, drawn.length[row], drawn.length[row - 1])
            np.testing.assert_allclose(at * on, others, atol=1e-12)
            np.testing.assert_array_equal(chosen.place[mine, 1], np.delete(np.arange(len(along)), own))
        stays = [k for k in range(len(drawn.division)) if k not in gone]
        np.testing.assert_array_equal(part.source, drawn.division.source[stays])
        np.testing.assert_array_equal(part.share, drawn.division.share[stays])
        ends = part.command[np.arange(len(part))].position
        np.testing.assert_allclose(ends, drawn.division.command[np.array(stays)].position, atol=0)
        assert (np.delete(drawn.division.role, stays) == Role.INTERMEDIATE).all()


def test_nothing_is_fitted_without_ramps_or_room() -> None:
    drawn = next(one for one in map(Drawn, SEEDS) if one.expected())
    words = (drawn.result, drawn.division)
    for job, limits in (
        (drawn.job, replace(drawn.limits, no_insert=True)),
        (replace(drawn.job, force=replace(drawn.job.force, ramps=None)), drawn.limits),
    ):
        part, chosen, left = choose_ramp_points(
            job, *words, limits, {}, ALLOWED, np.empty(0, int), Fits({}, {})
        )  # type: ignore[arg-type]
        assert part is drawn.division
        assert chosen is None
        assert not len(left)
