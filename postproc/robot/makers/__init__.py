"""What programs state of the robot's configuration, maker by maker: only these modules know the numbers' meaning."""

from __future__ import annotations

from postproc.robot.makers.abb import Abb
from postproc.robot.makers.fanuc import Fanuc
from postproc.robot.makers.kuka import Kuka
from postproc.robot.makers.maker import SIGN_MARGIN, Maker
from postproc.toolpath import Configuration

__all__ = ["MAKERS", "SIGN_MARGIN", "Maker", "maker_of"]

MAKERS = (Kuka(), Abb(), Fanuc())
"""Those whose statements are understood."""


def maker_of(configuration: Configuration) -> Maker:
    """The one that states these numbers; one that states nothing where no one does."""
    return next((one for one in MAKERS if not configuration.numbers.keys().isdisjoint(one.names)), Maker())
