"""All codes of all rooms: for ``check --explain`` and ``check --list-codes``."""

from __future__ import annotations

from collections.abc import Mapping

from postproc.base import input_files, paged_memory, yaml_section
from postproc.base.findings import Code
from postproc.batching import codes as batch
from postproc.cell import codes as cell
from postproc.compensation import codes as compensation
from postproc.diagnosis import codes as diagnosis
from postproc.experiments import codes as experiments
from postproc.identification import codes as identification
from postproc.languages import codes as dialects
from postproc.languages.gcode import codes as gcode
from postproc.languages.krl import codes as krl
from postproc.languages.rapid import codes as rapid
from postproc.languages.tp import codes as tp
from postproc.learning import codes as learning
from postproc.measurements import codes as measurements
from postproc.model import codes as model
from postproc.output import atomic_write
from postproc.part import codes as part
from postproc.placement import codes as placement
from postproc.process import codes as forces
from postproc.robot import codes as robot
from postproc.workflows import codes as workflows

TABLES: tuple[Mapping[str, Code], ...] = tuple(
    room.CODES
    for room in (
        input_files,
        paged_memory,
        atomic_write,
        yaml_section,
        cell,
        dialects,
        krl,
        gcode,
        rapid,
        tp,
        robot,
        model,
        forces,
        measurements,
        compensation,
        part,
        identification,
        diagnosis,
        experiments,
        placement,
        learning,
        workflows,
        batch,
    )
)
ALL: dict[str, Code] = {code: table[code] for table in TABLES for code in sorted(table)}
