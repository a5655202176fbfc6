"""``python -m tests.judge [--rule centred|after|stretched] [words of names]``: what the judge finds of the cases;
``further``: of those of ``further_cases``.

``--package FOLDER`` judges the package that lies there.  ``--drawn COUNT [--seed S]``: of so many programs drawn at
random instead, where a line with exit 0 that failed, or whose error ``verify`` does not see, is a defect.
``--third yes``: what ``third`` finds by brute force is printed beside (a minute a case).
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from .cases import CASES, DEG, PACKAGE, Outcome, run
from .drawn import defects, drawn
from .force import RULE
from .further_cases import FURTHER
from .motion import MM
from .third import third

HEADER = (
    f"{'case':38} {'exit':>4} {'before':>8} {'after':>8} {'out mm':>8} {'rms':>8} {'axis deg':>8} {'ori deg':>8}"
    f" {'stops':>6} {'back':>5} {'motions':>11} {'verify':>8} {'differs':>8}  verdict"
)
"""Errors in mm; out mm: length of the path beyond the tolerance; stops after/before; differs: what ``verify`` says less
what the judge finds."""


def row(outcome: Outcome) -> str:
    name = f"{outcome.case.name[:38]:38} {outcome.exit:4d}"
    word = "; ".join(outcome.failed) or "ok"
    if outcome.verdict is None:
        return f"{name} {'':>95}  {word} | {outcome.message[:120]}"
    before, after, cell = outcome.verdict.before, outcome.verdict.after, outcome.verdict.cell
    one, two = outcome.verdict.motions
    told = off = ""
    if outcome.verify is not None:
        told, off = f"{outcome.verify:.4f}", f"{1000 * (outcome.verify - after.largest / MM):+.1f}um"
    figures = (before.largest / MM, after.largest / MM, after.beyond(cell.tolerance) / MM, after.rms / MM)
    return (
        f"{name} {figures[0]:8.4f} {figures[1]:8.4f} {figures[2]:8.2f} {figures[3]:8.4f}"
        f" {after.axis.max() * DEG:8.4f} {after.angle.max() * DEG:8.4f} {after.stops:>3}/{before.stops:<2}"
        f" {len(after.backwards):5} {one:>5}/{two:<5} {told:>8} {off:>8}  {word} (line {after.worst_line})"
    )


def _by_force(folder: Path) -> str:
    output = next(file for file in (folder / "compensated").iterdir() if file.suffix in (".src", ".ngc"))
    largest, line, _ = third(folder / output.name, output, folder / "cell.yaml")
    return f"  by brute force {largest / MM:.4f} (line {line})"


def main(words: list[str]) -> int:
    failed, rule, package, count, seed, brute = 0, "", PACKAGE, 0, 0, False
    if "--help" in words:
        print(__doc__)
        return 0
    while words and words[0].startswith("--"):
        option, value, *words = words
        if option == "--rule":
            rule = value
        elif option == "--drawn":
            count = int(value)
        elif option == "--seed":
            seed = int(value)
        elif option == "--third":
            brute = value == "yes"
        else:
            package = Path(value).resolve()
    print(HEADER, flush=True)
    cases = (
        [drawn(number) for number in range(seed, seed + count)]
        if count
        else FURTHER
        if words == ["further"]
        else CASES
    )
    for case in cases:
        if words not in ([], ["further"]) and not any(word in case.name for word in words):
            continue
        with tempfile.TemporaryDirectory() as folder:
            outcome = run(case, Path(folder), verify=True, rule=rule or RULE, package=package)
            by_force = _by_force(Path(folder)) if brute and outcome.verdict is not None else ""
        wrong = defects(outcome) if count else outcome.failed
        failed += bool(wrong)
        print(
            row(outcome) + by_force + (f"  DEFECT: {'; '.join(wrong)}" if count and wrong else ""), flush=True
        )
    print(f"{failed} failed" if not count else f"{failed} of {count} with a defect")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
