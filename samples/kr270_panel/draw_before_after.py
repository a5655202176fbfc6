"""Draws before_after.svg: the finished walls of panel.src, and where the tool goes, as posted and compensated.

Everything comes from runs of the command in a temporary copy: the panel is compensated, and both programs are predicted
from their files.  The tool's path is the programmed point plus its predicted deflection, both in the axes of the base,
seen from above.

    python samples/kr270_panel/draw_before_after.py [FILE.svg]
"""

from __future__ import annotations

import csv
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from postproc.cli.main import run

HERE = Path(__file__).resolve().parent
WALLS = ("6", "7", "8", "10")  # cuts: the last pass along the wall of each pocket
EXAGGERATED = 15
PLATE = (900.0, 600.0)  # mm
SCALE, MARGIN, HEAD = 0.5, 12.0, 50.0  # px/mm, px
ORANGE, BLUE, GREY = "#d55e00", "#0072b2", "#8a8a8a"

Walls = list[np.ndarray]
"""Points (N, 2) [mm] of each wall, in the axes of the base."""


def run_command(*words: str | Path) -> None:
    try:
        run([str(word) for word in words])
    except SystemExit as end:
        if end.code not in (0, 3):
            raise


def read_walls(table: Path) -> dict[str, list[dict[str, str]]]:
    """The rows of each wall."""
    with table.open(newline="", encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["cut"] in WALLS]
    return {cut: [row for row in rows if row["cut"] == cut] for cut in WALLS}


def read_columns(rows: list[dict[str, str]], pattern: str) -> np.ndarray:
    """(N, 2) [mm]: the columns of x and y."""
    return np.array([[float(row[pattern.format(axis)]) for axis in "xy"] for row in rows])


def exaggerate(wanted: np.ndarray, target: np.ndarray, deflection: np.ndarray) -> np.ndarray:
    """(N, 2) [mm]: where the tool goes, its distance from the nearest part of the wanted path exaggerated."""
    goes = target + deflection
    begin, along = wanted[:-1], np.diff(wanted, axis=0)
    share = ((goes[:, None] - begin) * along).sum(-1) / (along**2).sum(-1)
    foot = begin + np.clip(share, 0, 1)[..., None] * along
    nearest = foot[np.arange(len(goes)), np.linalg.norm(goes[:, None] - foot, axis=-1).argmin(1)]
    return nearest + EXAGGERATED * (goes - nearest)


def draw_line(points: np.ndarray, left: float, style: str) -> str:
    x, y = left + SCALE * points[:, 0], HEAD + SCALE * (PLATE[1] - points[:, 1])
    text = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return f'<polyline points="{text}" fill="none" {style}/>'


def draw_panel(left: float, title: str, colour: str, wanted: Walls, goes: Walls) -> list[str]:
    width, height = (SCALE * size for size in PLATE)
    return [
        f'<text x="{left:g}" y="20" font-weight="bold">{title}</text>',
        f'<rect x="{left:g}" y="{HEAD:g}" width="{width:g}" height="{height:g}" fill="#f6f6f6" stroke="#c8c8c8"/>',
        *(draw_line(points, left, f'stroke="{GREY}" stroke-width="1"') for points in wanted),
        *(draw_line(points, left, f'stroke="{colour}" stroke-width="1.6"') for points in goes),
    ]


def draw() -> str:
    with TemporaryDirectory() as name:
        folder = Path(name)
        program = folder / "panel.src"
        for file in ("panel.src", "cell.yaml"):
            shutil.copy(HERE / file, folder)
        run_command(program, "--force", "-q", "-o", folder / "out")
        for source, report in ((program, "posted"), (folder / "out" / "panel.src", "sent")):
            run_command(
                "predict",
                source,
                "--force",
                "--cell",
                folder / "cell.yaml",
                "--report",
                folder / report,
                "-q",
            )
        corrected = read_walls(folder / "out" / "panel.corrections.csv")
        posted, sent = (read_walls(folder / report / "panel.deflection.csv") for report in ("posted", "sent"))
    wanted = [read_columns(posted[cut], "{}_mm") for cut in WALLS]
    before, after = (
        [
            exaggerate(path, read_columns(table[cut], "{}_mm"), read_columns(table[cut], "deflection_{}_mm"))
            for cut, path in zip(WALLS, wanted, strict=True)
        ]
        for table in (posted, sent)
    )
    largest = [
        max(float(row[column]) for cut in WALLS for row in corrected[cut])
        for column in ("error_before_mm", "error_after_mm")
    ]
    width, height = (SCALE * size for size in PLATE)
    second = 2 * MARGIN + width
    size = f"{3 * MARGIN + 2 * width:g}", f"{HEAD + height + MARGIN:g}"
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size[0]} {size[1]}" width="{size[0]}" '
        f'height="{size[1]}" font-family="sans-serif" font-size="15">',
        "<title>Four pocket walls from above: as posted the tool is beside them, compensated it is on them</title>",
        '<rect width="100%" height="100%" fill="white"/>',
        *draw_panel(MARGIN, f"as posted: up to {largest[0]:.2f} mm off", ORANGE, wanted, before),
        *draw_panel(second, f"compensated: up to {largest[1]:.4f} mm off", BLUE, wanted, after),
        f'<text x="{MARGIN:g}" y="40" fill="#555">grey: the wall that is wanted; colour: where the bent robot '
        f"takes the tool, predicted, deviation drawn {EXAGGERATED} times as large</text>",
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "before_after.svg"
    out.write_text(draw(), encoding="utf-8")
