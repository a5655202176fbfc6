"""Templates as Python compiles modules: once, beside their source."""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
import sys
from pathlib import Path

from jinja2 import BytecodeCache
from jinja2.bccache import Bucket

DIGEST = hashlib.sha256().digest_size
"""Bytes before the compiled template, by which a damaged file is none."""


class CompiledTemplates(BytecodeCache):
    """Compiled templates in ``folder``, a ``__pycache__`` beside them; each states the versions of Python and Jinja,
    and the digest of its source and of ``settings``, which says how it is compiled.  Where the folder takes no files,
    or Python writes none (PYTHONDONTWRITEBYTECODE), templates are compiled again."""

    def __init__(self, folder: Path, settings: bytes) -> None:
        self.folder, self.settings = folder, settings

    def get_source_checksum(self, source: str) -> str:
        return hashlib.sha256(self.settings + b"\0" + source.encode()).hexdigest()

    def _path(self, bucket: Bucket) -> Path:
        return self.folder / f"{bucket.key}.{sys.implementation.cache_tag}.jinja"

    def load_bytecode(self, bucket: Bucket) -> None:
        with contextlib.suppress(OSError):
            content = self._path(bucket).read_bytes()
            if hashlib.sha256(content[DIGEST:]).digest() == content[:DIGEST]:
                bucket.bytecode_from_string(content[DIGEST:])

    def dump_bytecode(self, bucket: Bucket) -> None:
        if sys.dont_write_bytecode:
            return
        path, content = self._path(bucket), bucket.bytecode_to_string()
        ready = path.with_suffix(f".{secrets.token_hex(4)}.tmp")
        try:
            self.folder.mkdir(exist_ok=True)
            ready.write_bytes(hashlib.sha256(content).digest() + content)
            os.replace(ready, path)
        except OSError:
            with contextlib.suppress(OSError):
                ready.unlink()
