"""How often corners are evaluated: roughly first where there are many, closely the few that count."""

from __future__ import annotations

import numpy as np
import pytest
from spring_cases import MM, output, spring

from postproc.compensation import corners
from postproc.compensation.rounded_path import RoundedOutput

ALL = corners.ALWAYS


@pytest.mark.parametrize(
    ("count", "rough", "close"), [(1, 0, 1), (ALL, 0, ALL), (ALL + 1, ALL + 1, ALL), (3 * ALL, 3 * ALL, ALL)]
)
def test_corners_are_evaluated_roughly_only_where_not_all_of_them_are_evaluated_closely(
    monkeypatch: pytest.MonkeyPatch, count: int, rough: int, close: int
) -> None:
    points = np.arange(count + 4)[:, None] * [10 * MM, 0.0, 0.0]
    carries = [False] + [True] * (count + 3)
    job = spring(points, carries, approximation=np.full(count + 4, 2 * MM))
    division = output(job, np.zeros((count + 4, 3)))
    asked = {len(corners.FEW): 0, len(corners.SAMPLES): 0}
    evaluate = corners.evaluate_corners

    def counted(
        rounded: RoundedOutput, motions: np.ndarray, samples: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        asked[len(samples)] += len(motions)
        return evaluate(rounded, motions, samples)

    monkeypatch.setattr(corners, "evaluate_corners", counted)
    found = corners.compare_corners_at(job, division, np.arange(2, count + 2))
    assert list(asked.values()) == [rough, close]
    np.testing.assert_allclose(found.distance, 2 * MM, rtol=1e-3)
