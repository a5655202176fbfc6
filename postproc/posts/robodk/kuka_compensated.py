"""RoboDK post-processor: what a post for KUKA generates, compensated for the deflection of the robot.

``compensate posts robodk -o FOLDER`` puts this file beside RoboDK's posts (C:/RoboDK/Posts); choose it as the robot's
post-processor and state below what is yours.  The posted program goes to ``uncompensated/`` beside the output, and the
command ``compensate`` writes the output.  Where anything fails the output does not exist and nothing is sent to the
robot.  It runs in RoboDK's Python and needs nothing but the command; ``cell.yaml`` is looked for beside the output and
above.  Forces are stated by comments (;FORCE 120 260 -60 @FEED), the cell, or ``FORCE`` below.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import shlex
import shutil
import subprocess
from pathlib import Path
from typing import Any

BASE_POST = "KUKA_KRC2"
"""The post that generates the program: a file in the same folder.  It writes its file in ``progsave``."""
COMPENSATE = "compensate"
"""The command, or its path."""
FORCE = ""
"""Of the command: "" (comments, CSV or cell), 0,360,560@base, a CSV, or a process file."""
OPTIONS: list[str] = []
"""More options of the command: ["--gain", "0.5"]."""
FOLDER = "uncompensated"

_Base: Any = importlib.import_module(BASE_POST).RobotPost
if not hasattr(_Base, "progsave"):
    raise ImportError(
        f"the post {BASE_POST} does not write its file in progsave: name another one in BASE_POST"
    )


class RobotPost(_Base):  # type: ignore[misc]
    """The base post with one page, whose file is compensated as soon as it is there."""

    MAX_LINES_X_PROG = 10**9

    def __init__(self, *words: Any, **named: Any) -> None:
        named.pop("lines_x_prog", None)  # a page without its start is no program
        super().__init__(*words, **named)
        self.PROG_FILES: list[str] = []

    def progsave(
        self, folder: str, progname: str, ask_user: bool = False, show_result: bool | str | list[str] = False
    ) -> None:
        """Writes one page.  Raises RuntimeError; then its file is not there."""
        if len(getattr(self, "PROG_LIST", ())) > 1:
            raise RuntimeError("compensate: the program has several pages, and a cut must be in one file")
        target = _target(folder, f"{progname}.{self.PROG_EXT}", ask_user)
        if target is None:
            return  # the user does not want it
        target.unlink(missing_ok=True)
        posted = target.parent / FOLDER / target.name
        posted.parent.mkdir(parents=True, exist_ok=True)
        posted.unlink(missing_ok=True)
        self.PROG_FILES = []
        with contextlib.redirect_stdout(io.StringIO()):  # RoboDK reads there which file is the result
            super().progsave(posted.parent.as_posix(), target.stem, False, False)
        self.PROG_FILES = []
        if not posted.exists():
            raise RuntimeError(f"compensate: {BASE_POST} does not write {posted}")
        printed = _compensate(posted, target)
        self.PROG_FILES = [str(target)]
        print(printed)
        print(f"SAVED: {target}\n")
        _show(target, show_result)


def _target(folder: str, name: str, ask_user: bool) -> Path | None:
    if not ask_user and os.path.isdir(folder):
        return Path(folder).absolute() / name
    from robodk.robofileio import getSaveFile

    chosen = getSaveFile(folder, name, "Save program as...")
    chosen = getattr(chosen, "name", chosen)
    return Path(chosen).absolute() if chosen else None


def _compensate(posted: Path, target: Path) -> str:
    command = shutil.which(COMPENSATE)
    words = [command] if command else shlex.split(COMPENSATE)
    words += [str(posted), f"--force={FORCE}", "-o", str(target), "--report", str(posted.parent), *OPTIONS]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONHOME"}  # RoboDK's own
    try:
        done = subprocess.run(words, env=environment, capture_output=True, check=False)
    except OSError as error:
        raise RuntimeError(f"compensate: {words[0]!r} does not start ({error}): set COMPENSATE") from error
    printed = (done.stdout + done.stderr).decode("utf-8", "replace")
    if done.returncode not in (0, 3) or not target.exists():
        target.unlink(missing_ok=True)
        raise RuntimeError(f"compensate: exit code {done.returncode}, there is no program:\n{printed}")
    return printed


def _show(target: Path, show_result: bool | str | list[str]) -> None:
    """Opens the result as the settings of RoboDK say."""
    if isinstance(show_result, (str, list)) and show_result:
        words = [show_result] if isinstance(show_result, str) else show_result
        subprocess.Popen([*words, str(target)])
    elif show_result and hasattr(os, "startfile"):
        os.startfile(target)
