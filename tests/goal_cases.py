"""Which goals the cases reach whose truth is known: the worst of each, of the tests that compare them.

python -m tests.goal_cases
"""

from __future__ import annotations

import io
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent


def table(rows: list[tuple[str, str, float, float]]) -> str:
    """A line for each case and figure, with the worst of its rows: case, figure, off, goal."""
    worst: dict[tuple[str, str], tuple[int, float, float]] = {}
    for case, figure, off, goal in rows:
        count, most, _ = worst.get((case, figure), (0, 0.0, goal))
        worst[case, figure] = (count + 1, max(most, off), goal)
    lines = [f"{'case':<32}{'figure':<10}{'cuts':>5}{'off':>9}{'goal':>7}  reached"]
    for (case, figure), (count, off, goal) in sorted(worst.items()):
        reached = "yes" if off < goal else "no"
        lines.append(f"{case:<32}{figure:<10}{count:>5}{off:>9.4f}{goal:>7.2f}  {reached}")
    return "\n".join(lines)


def main() -> int:
    """Run the tests and print the table."""
    sys.path.insert(0, str(FOLDER))
    out = io.StringIO()
    with redirect_stdout(out):
        code = int(pytest.main(["-q", "-n", "0", "-m", "", str(FOLDER / "test_engagement.py")]))
    import stock_cases

    if code:
        print(out.getvalue())
    print(table(stock_cases.GOALS))
    return code


if __name__ == "__main__":
    raise SystemExit(main())
