"""The process that diagnoses: is told command lines of ``compensate``, one a line as JSON with the folder to work in,
and answers each with its exit code and how long it took.

It may open nothing of a run but that folder, which holds readings and a robot file, and gets what is written.
"""

from __future__ import annotations

import json
import os
import sys
import time
import traceback
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from postproc.cli.main import run as compensate

ROOMS = "blind-"
"""How the folders of all runs begin, by ``tempfile``."""

allowed_folder = ""


def guard(event: str, arguments: tuple) -> None:
    """Refuses to open or list anything of a run but what was told."""
    if (
        event in ("open", "os.listdir", "os.scandir")
        and arguments
        and isinstance(arguments[0], str | bytes | os.PathLike)
    ):
        path = os.path.abspath(os.fsdecode(arguments[0]))
        inside = path == allowed_folder or path.startswith(allowed_folder + os.sep)
        if f"{os.sep}{ROOMS}" in path and not inside:
            raise PermissionError(f"{path} is none of the diagnosis's business")


def ran(folder: str, words: list[str]) -> dict:
    """What one command line came to, in ``folder``, and its seconds of the processor; exit -1: it crashed."""
    global allowed_folder
    allowed_folder = os.path.abspath(folder)
    os.chdir(folder)
    begun, told = time.process_time(), StringIO()
    try:
        with redirect_stdout(told), redirect_stderr(told):
            compensate(words)
        code = 0
    except SystemExit as ended:
        code = ended.code
    except Exception:
        code = -1
        told.write(traceback.format_exc())
    return {"exit": code, "told": told.getvalue(), "seconds": time.process_time() - begun}


def main() -> None:
    sys.addaudithook(guard)
    for line in sys.stdin:
        print(json.dumps(ran(*json.loads(line))), flush=True)


if __name__ == "__main__":
    main()
