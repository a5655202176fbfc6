"""One path written in several languages is corrected as one path."""

from __future__ import annotations

from pathlib import Path

import pytest
from written_paths import KINDS, WITHIN_DEG, WITHIN_MM, WRITERS, differences


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(2 * len(KINDS)))
def test_a_path_is_corrected_alike_in_all_languages(seed: int, tmp_path: Path) -> None:
    off, turned, count = differences(tmp_path / "path", seed)
    assert off < WITHIN_MM
    assert turned < WITHIN_DEG
    assert count >= len(WRITERS) - 1
