"""``python -m tests.circle_test``: a circle as a machine with gaps draws it (ISO 230-4), before and after correction.

A KR 270 with gaps of 2e-4 rad in A1 and A2, 1 mm chords, on MuJoCo (``circles``); and a straight line whose axis 1
moves by the last written digit only, which is to turn no correction round.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

sys.path.insert(0, str(Path(__file__).parent))

from circles import circle
from test_circles import ABSOLUTE, GAP, LETTERS, arm, before, corrections_of, drawn, straight

from postproc.workflows.preparation import Request
from postproc.workflows.program import compensate


def job(folder):
    """What the tests' fixture of that name is, in a folder."""
    folder.mkdir()

    def write(lines):
        (folder / "part.src").write_text("\n".join(lines) + "\n")
        return folder / "part.src"

    return SimpleNamespace(
        folder=folder,
        cell=(folder / "cell.yaml").write_text,
        write=write,
        output=folder / "compensated" / "part.src",
    )


def main() -> int:
    failed = 0
    print(f"{'gap of':12} {'known to':>9} {'corrected':>10} {'before mm':>10} {'after mm':>9} {'factor':>7}")
    with tempfile.TemporaryDirectory() as name:
        for effect in LETTERS:
            for share, mode in ((1.0, {}), (1.0, ABSOLUTE), (0.7, {}), (1.3, {})):
                here = job(Path(name) / f"{effect}{share}{len(mode)}")
                arm(here, effect, share * GAP, **mode)
                compensate(Request(here.write(circle()), force=""))
                after = drawn(here.output.read_text())
                failed += before() / after < (5.0 if share == 1.0 else 2.7)
                known = "exactly" if share == 1.0 else f"{100 * (share - 1):+.0f} %"
                word = mode.get("correct", "process")
                print(
                    f"{effect:12} {known:>9} {word:>10} {before():10.4f} {after:9.4f} {before() / after:7.1f}"
                )
            here = job(Path(name) / f"{effect}, straight")
            arm(here, effect, GAP, (1,))
            source = here.write(straight())
            compensate(Request(source, force=""))
            moved = corrections_of(source, here.output)
            turns = int((moved[1:] * moved[:-1] < 0).sum())
            failed += turns > 0
            print(f"{effect}, straight line, A1 by rounding: {turns} changes of sign in {len(moved)} motions")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
