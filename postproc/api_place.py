"""The functions on places of parts: where one lies, and which of a batch lies where."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, TypeAlias

from postproc.report.assignment import PartAssignment
from postproc.report.placement import Placement

PathLike: TypeAlias = str | os.PathLike[str]
Force: TypeAlias = bool | str | os.PathLike[str] | Sequence[float]
"""True: those that belong to the program; a wrench as text or as three or six numbers [N, N m]; a file."""

PlaceRange: TypeAlias = tuple[float, float] | None


def place(
    paths: PathLike | Sequence[PathLike],
    *,
    force: Force = False,
    x: PlaceRange = None,
    y: PlaceRange = None,
    z: PlaceRange = None,
    turn: PlaceRange = None,
    tool_turn: PlaceRange = None,
    track: PlaceRange = None,
    objective: Literal["across", "max", "p95", "uncertainty"] = "across",
    direction: float | None = None,
    limit_margin: float = 5.0,
    singularity_margin: float = 5.0,
    top: int = 10,
    cell: PathLike | None = None,
    robot: str | None = None,
    collisions: PathLike | None = None,
    output: PathLike | None = None,
    spin: bool = False,
    spin_output: PathLike | None = None,
    picture: PathLike | None = None,
    page: PathLike | None = None,
    config_dat: PathLike | None = None,
    tare: bool = False,
    strict: bool = False,
) -> Placement:
    """Where a part should lie, as ``compensate place`` does.

    paths: one program, or several that share a base; x, y, z: ranges of the base's origin in $WORLD, mm; turn,
    tool_turn: of part and tool against the present, deg; track: of the linear track, mm; None: as ``room`` of the cell
    states, or as it is; objective: what is small at a good place; direction: interval of the forces' direction over
    which it is averaged, deg [the cell's]; limit_margin, singularity_margin: deg; collisions: URDF with
    collision shapes; top: places to list; output: the new
    cell file; spin: what turning the tool about its spindle along the path brings; spin_output: folder for the programs
    that do.  Raises ValueError for ranges that do not ascend.

    >>> import postproc
    >>> sample = "samples/kr270_taught/taught.src"
    >>> placed = postproc.place(sample, force=True, x=(1300, 1600), y=(-300, 100), top=3)
    >>> placed.best.across.max < placed.present.across.max, len(placed.places)
    (True, 3)
    """
    from postproc.workflows.place import place as run
    from postproc.workflows.place_problem import PlaceRequest

    stated = {"x": x, "y": y, "z": z, "turn": turn, "tool_turn": tool_turn, "track": track}
    ranges = {name: (float(ends[0]), float(ends[1])) for name, ends in stated.items() if ends is not None}
    for name, (low, high) in ranges.items():
        if not low < high:
            raise ValueError(f"{name} is (from, to) with from < to, and is ({low:g}, {high:g})")
    several = (paths,) if isinstance(paths, (str, os.PathLike)) else tuple(paths)
    return run(
        PlaceRequest(
            programs=tuple(Path(path) for path in several),
            force=stated_force(force),
            ranges=ranges,
            objective=objective,
            direction=direction,
            limit_margin=limit_margin,
            singularity_margin=singularity_margin,
            top=top,
            cell=as_path(cell),
            robot=robot,
            collisions=as_path(collisions),
            config_dat=as_path(config_dat),
            tare=tare,
            output=as_path(output),
            spin=spin,
            spin_output=as_path(spin_output),
            picture=as_path(picture),
            page=as_path(page),
            strict=strict,
        )
    )


def assign(
    paths: Sequence[PathLike],
    places: Mapping[str, Sequence[float]],
    *,
    force: Force = False,
    objective: Literal["across", "max", "p95", "uncertainty"] = "across",
    limit_margin: float = 5.0,
    singularity_margin: float = 5.0,
    cell: PathLike | None = None,
    robot: str | None = None,
    collisions: PathLike | None = None,
    cells: PathLike | None = None,
    config_dat: PathLike | None = None,
    tare: bool = False,
    strict: bool = False,
) -> PartAssignment:
    """Which part of a batch lies where, as ``compensate assign`` does.

    paths: the programs, each of a part; places: name -> x, y, z [mm] of the base's origin in $WORLD, and maybe the turn
    [deg] about the vertical through it against the present; objective: what is added up; limit_margin,
    singularity_margin: deg; collisions: URDF with collision shapes; cells: folder for the cell files.
    Raises ValueError for a place of another form.
    """
    from postproc.workflows.place_parts import AssignRequest
    from postproc.workflows.place_parts import assign as run
    from postproc.workflows.place_problem import PlaceRequest

    stated: dict[str, tuple[float, float, float, float]] = {}
    for name, values in places.items():
        if len(values) not in (3, 4) or not all(math.isfinite(value) for value in values):
            raise ValueError(f"the place {name!r} is not x, y, z or x, y, z, turn")
        x, y, z, turn = (float(value) for value in (*values, 0.0)[:4])
        stated[name] = (x, y, z, turn)
    common = PlaceRequest(
        programs=tuple(Path(path) for path in paths),
        force=stated_force(force),
        objective=objective,
        limit_margin=limit_margin,
        singularity_margin=singularity_margin,
        cell=as_path(cell),
        robot=robot,
        collisions=as_path(collisions),
        config_dat=as_path(config_dat),
        tare=tare,
        strict=strict,
    )
    return run(AssignRequest(common, stated, as_path(cells)))


def stated_force(force: Force) -> str | None:
    """As ``Request`` has it.  Raises ValueError where it is empty, TypeError where it states no force."""
    if force is False or force is None:
        return None
    if force is True:
        return ""
    if isinstance(force, (str, os.PathLike)):
        text = str(force)
        if not text.strip():
            raise ValueError("force is empty; use True for the forces that belong to the program")
        return text
    try:
        numbers = [str(float(number)) for number in force]
    except (TypeError, ValueError):
        numbers = []
    if not numbers:
        message = (
            f"force is {force!r:.40}; use True, '0,360,560@base', three or six numbers [N, N m], or a CSV"
        )
        raise TypeError(message)
    return ",".join(numbers)


def as_path(path: PathLike | None) -> Path | None:
    """The path, None without one."""
    return None if path is None else Path(path)
