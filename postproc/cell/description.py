"""What is known of a robot cell, in SI and radians."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from postproc.base.arrays import Floats, frozen
from postproc.base.findings import Finding
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.cell.stated_room import StatedRoom
from postproc.cell.tool_errors import ToolError
from postproc.languages import DIALECT_OPTIONS
from postproc.robot.external_axes import ExternalAxis
from postproc.toolpath.initial_state import UNSTATED, InitialState, Symbol

MODES = ("process", "absolute", "touched_off")
"""What is corrected."""


@dataclass(frozen=True, eq=False)
class Tool:
    """``pose``: TCP in the flange.  ``axis`` (3,): unit vector of the spindle, tip-ward, in the tool's axes.

    ``mass`` [kg] and ``com`` (3,) [m, flange axes]: both or neither.  ``diameter`` [m] of the cutter, None where it is
    not stated.
    """

    pose: Poses
    axis: Floats
    mass: float | None = None
    com: Floats | None = None
    diameter: float | None = None


@dataclass(frozen=True)
class Controller:
    """What the controller corrects by itself: its geometric model, the sag under weight and payload; ``cycle_ms``: its
    interpolation cycle [ms]."""

    absolute_accuracy: bool = False
    gravity_compensated: bool = False
    cycle_ms: float = 12.0


@dataclass(frozen=True, eq=False)
class ForceVectorInterval:
    """Half widths of the 95 % intervals of the forces besides their scale.

    ``direction`` [rad]: of two small independent turns of each force about axes across it; ``components`` (3,) [N]: of
    a force that is added to all others, along the axes of the programmed base.
    """

    direction: float = 0.0
    components: Floats | None = None


@dataclass(frozen=True)
class ForceFactor:
    """What was learnt of the force of an operation: ``factor`` of what is stated; ``ci95``: half width of its 95 %
    interval as a share, None without; ``turn`` [rad] of its direction about two axes across it: the one that lifts it
    and the one that swings it."""

    factor: float
    ci95: float | None = None
    turn: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Cell:
    """One checked cell file.

    robot_base: robot root in $WORLD; bases: in $WORLD; orientation (3,) A, B, C: [rad];
    start_stated (6,) or (7,): joint values before the first motion, deg, mm for a linear axis;
    tolerance, max_correction, min_segment [m]; tolerance_angle [rad].  ``force`` is the text of the key, a path
    in it is relative to the cell file; ``force_line`` is where it is.  ``force_ci95``: half width of the 95 %
    interval of all forces, as a share of them; None where nothing is stated.  ``dialect``: name of the programs'
    language, where their names and contents do not identify it; ``dialect_options``: key of a ``DialectOption`` -> what
    is stated for it, a file relative to the cell file.  ``force_vector``: intervals of the forces besides their scale;
    ``force_factors``: operation -> what was learnt of its force; ``tool_errors``: number of a tool -> how it differs
    from what is programmed; ``force_ramp`` [m]: the path over which a force changes, None where it is not stated.
    ``correct``: one of ``MODES``; ``touch_points``: number of a
    base -> (K, 3) [m] places in it at which it was touched off, None for the one base that a program uses;
    ``touch_line`` is where they are.  ``temperature`` [degC] of the robot.
    ``symbols``: values of names that only the controller knows; ``program_start``: the state at the first statement;
    ``room``: where a part may be placed, None where nothing is stated;
    ``findings``: what is implausible in the file.
    """

    path: Path
    robot: str
    robot_base: Poses = field(default_factory=Poses.identity)
    tools: dict[int, Tool] = field(default_factory=dict)
    bases: dict[int, Poses] = field(default_factory=dict)
    force: str | None = None
    force_line: int = 0
    force_ci95: float | None = None
    process: str | None = None
    correct: str = "process"
    start_stated: Floats | None = None
    start_line: int = 0
    orientation: Floats | None = None
    tolerance: float = 0.02 * MM
    tolerance_angle: float = 0.01 * DEG
    max_correction: float = 10.0 * MM
    min_segment: float = 1.0 * MM
    max_growth: float = 2.0
    growth_stated: bool = False
    segment_stated: bool = False
    controller: Controller = Controller()
    dialect: str | None = None
    dialect_line: int = 0
    dialect_options: Mapping[str, str] = field(default_factory=dict)
    force_vector: ForceVectorInterval | None = None
    force_ramp: float | None = None
    force_factors: Mapping[str, ForceFactor] = field(default_factory=dict)
    force_factors_line: int = 0
    tool_errors: Mapping[int, ToolError] = field(default_factory=dict)
    tool_errors_line: int = 0
    touch_points: dict[int | None, Floats] = field(default_factory=dict)
    touch_line: int = 0
    temperature: float | None = None
    temperature_line: int = 0
    external_axes: tuple[ExternalAxis, ...] = ()
    symbols: Mapping[str, Symbol] = field(default_factory=dict)
    program_start: InitialState = UNSTATED
    room: StatedRoom | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def dialect_files(self) -> list[Path]:
        """The files that ``dialect_options`` names."""
        files = [one.key for one in DIALECT_OPTIONS if one.is_file]
        return [self.path.parent / self.dialect_options[key] for key in files if key in self.dialect_options]

    @property
    def cycle_ms(self) -> float:
        """Interpolation cycle of the controller [ms]."""
        return self.controller.cycle_ms

    @property
    def start(self) -> Floats | None:
        """(n,) the values of ``start_stated`` as angles [rad]."""
        return None if self.start_stated is None else frozen(self.start_stated * DEG)
