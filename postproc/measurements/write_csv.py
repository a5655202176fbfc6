"""Writes readings as the CSV that reads back as them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import Poses, abc_from_rotation
from postproc.base.tables import as_cell
from postproc.base.units import DEG, MM
from postproc.measurements.header import RESERVED, WRENCH, direction_columns, value_columns
from postproc.measurements.header_comments import FRAMES
from postproc.measurements.readings import Readings, joint_units

_PLAIN = re.compile(r"[A-Za-z_][\w.-]*")


def measurements_csv(readings: Readings, about: Sequence[str] = ()) -> bytes:
    """The file that reads back as ``readings``; ``about``: comments to start with.

    Only columns that hold something are written, those of the measured values always.  Rounding: 1e-4 mm, 1e-4 deg
    (1e-6 deg of a deflection's angles), 1e-3 s and degC, 6 digits of a wrench or sigma.
    """
    comments = [line for text in about for line in text.splitlines()] + _comments(readings)
    state = _state(readings)
    columns = state | _measured(readings)
    # without the column rows with equal values are repeats
    repeat = readings.repeat
    if (repeat >= 0).any() or len(set(zip(*state.values(), strict=True))) < len(readings):
        single = repeat < 0
        ids = np.where(single, repeat.max(initial=-1) + np.cumsum(single), repeat)
        columns["REPEAT"] = [str(number + 1) for number in ids]
    columns |= {name: [as_cell(text) for text in texts] for name, texts in readings.extras.items()}
    stream = io.StringIO()
    for comment in comments:  # in quotes where a spreadsheet would cut a cell with a formula out of it
        quote = '"' if re.search(r"[,;\t][^\S\t]*+[=+@-]", comment) else ""
        stream.write(f"{quote}# {comment}{quote}\n")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return stream.getvalue().encode()


def number_texts(values: Floats) -> str:
    """``values`` (K,) with four decimals at most, separated by blanks."""
    return " ".join(text.rstrip("0").rstrip(".") for text in _fixed(values, 4))


def pose_text(pose: Poses) -> str:
    """``x y z a b c`` [mm, deg]"""
    return number_texts(np.concatenate([pose.position / MM, abc_from_rotation(pose.rotation) / DEG]))


def _comments(readings: Readings) -> list[str]:
    comments = []
    if readings.robot:
        comments.append(f"robot: {' '.join(readings.robot.split())}")
    if not readings.deflection:
        comments.append(f"frame: {FRAMES[readings.in_robot_frame]}")
    if readings.tool is not None:
        comments.append(f"tool: {pose_text(readings.tool)}")
    sigma = _one_sigma(readings)
    if sigma is not None:
        comments.append(f"sigma_mm: {sigma / MM:.6g}")
    if readings.sigma_turn is not None:
        comments.append(f"sigma_deg: {readings.sigma_turn / DEG:.6g}")
    nowhere = {name: None for name in sorted(readings.on_base) if name not in readings.places}
    for name, place in {**readings.places, **nowhere}.items():
        key = "base_target" if name in readings.on_base else "target"
        comments.append(f"{key} {name}: {'' if place is None else number_texts(place / MM)}".rstrip())
    return comments


def _state(readings: Readings) -> dict[str, list[str]]:
    """The columns that state what was measured, under which conditions."""
    columns = _all_fixed(_joint_names(readings), readings.q / joint_units(readings.joints), 4)
    for name, load in zip(WRENCH, readings.wrench.T, strict=True):
        if load.any():
            columns[name] = _digits(load + 0.0)  # no minus zero
    if readings.direction is not None:
        columns |= _all_fixed(direction_columns(len(readings.joints)), readings.direction, 0)
    if readings.temperature is not None:
        columns["TEMP"] = _fixed(readings.temperature, 3)
    if readings.targets:
        columns["TARGET"] = [as_cell(readings.targets[index]) for index in readings.target]
    if readings.sessions != ("",):
        columns["SESSION"] = [as_cell(readings.sessions[index]) for index in readings.session]
    return columns


def _measured(readings: Readings) -> dict[str, list[str]]:
    """The columns of what came out, when, and how well it is known."""
    values, angles = value_columns(readings.deflection)
    columns = _all_fixed(values, readings.value / MM, 4)
    if readings.rotation is not None:
        turned = np.full((len(readings), 3), np.nan)
        known = ~np.isnan(readings.rotation[:, 0, 0])
        turned[known] = abc_from_rotation(readings.rotation[known]) / DEG
        columns |= _all_fixed(angles, turned, 6 if readings.deflection else 4)
    if readings.time is not None:
        columns["T"] = _fixed(readings.time, 3)
    if _one_sigma(readings) is None and not np.isnan(readings.sigma).all():
        columns["SIGMA"] = _digits(readings.sigma / MM)
    return columns


def _one_sigma(readings: Readings) -> float | None:
    """[m] what all readings have, or None."""
    different = np.unique(readings.sigma)
    return float(different[0]) if len(different) == 1 and not np.isnan(different[0]) else None


def _joint_names(readings: Readings) -> list[str]:
    """The robot's own names of its joints, or A1..An where they would not be read back as such."""
    own = [name for name, _ in readings.joints]
    lower = {name.lower() for name in own}
    if len(lower) == len(own) and not lower & RESERVED and all(_PLAIN.fullmatch(name) for name in own):
        return own
    return [f"A{index}" for index in range(1, len(own) + 1)]


def _all_fixed(names: Sequence[str], values: Floats, decimals: int) -> dict[str, list[str]]:
    """A column of each name, of ``values`` (R, len(names))."""
    return {name: _fixed(column, decimals) for name, column in zip(names, values.T, strict=True)}


def _fixed(values: Floats, decimals: int) -> list[str]:
    """Fixed decimals, empty for what is not known, no minus zero."""
    rounded = np.round(values, decimals) + 0.0
    return ["" if value != value else f"{value:.{decimals}f}" for value in rounded.tolist()]


def _digits(values: Floats) -> list[str]:
    """Six digits, empty for what is not known."""
    return ["" if value != value else f"{value:.6g}" for value in values.tolist()]
