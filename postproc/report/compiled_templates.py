"""Templates as Python compiles modules: once, beside their source."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

from jinja2 import FileSystemBytecodeCache
from jinja2.bccache import Bucket


class CompiledTemplates(FileSystemBytecodeCache):
    """Compiled templates in ``folder``, a ``__pycache__`` beside them; each states the digest of its source and the
    versions of Python and Jinja.  Where the folder takes no files, or Python is told to write none
    (PYTHONDONTWRITEBYTECODE), templates are compiled anew."""

    def __init__(self, folder: Path) -> None:
        super().__init__(str(folder), f"%s.{sys.implementation.cache_tag}.jinja")

    def dump_bytecode(self, bucket: Bucket) -> None:
        if sys.dont_write_bytecode:
            return
        with contextlib.suppress(OSError):
            Path(self.directory).mkdir(exist_ok=True)
            super().dump_bytecode(bucket)
