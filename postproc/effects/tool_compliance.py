"""Tool compliance: cutter, holder and spindle deflect at the tool centre point."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.base.arrays import Floats
from postproc.effects.effect import ChainState, ComplianceLaw, Parameter, Values
from postproc.robot.geometries import Joint


class ToolCompliance(ComplianceLaw):
    """theta = c f: shifts of the TCP, ``radial`` [m/N] across the spindle, alike in all directions, ``axial`` [m/N]
    along it, by the force f [N] on the TCP in those directions.  The tool is not turned, and its mount stays.

    The spindle is the direction that the conditions state in tool axes, tip-ward; tool z without one.  A moment at the
    TCP moves nothing here.
    """

    name = "tool_compliance"
    family = "elastic"
    coordinates = ("spindle.x", "spindle.y", "spindle.z")

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "static compliance at the tip of cutter, holder and spindle"
        self.parameters = tuple(
            Parameter(name, "m/N", 0.0, 0.0, 1e-5, source) for name in ("radial", "axial")
        )

    def add_displacement(
        self, values: Values, state: ChainState, force: Floats, displacement: Floats, slope: Floats
    ) -> None:
        for name in self.coordinates:
            row = state.chain.index[name]
            compliance = values["axial" if name.endswith("z") else "radial"]
            displacement[row] += compliance * force[row]
            slope[row] += compliance
