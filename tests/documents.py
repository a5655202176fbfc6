"""The READMEs, held against real runs: what a document prints is what its commands print.

    python -m tests.documents                     run all blocks; name those that have drifted (exit code 1)
    python -m tests.documents --write             rewrite every block that has drifted from its run
    python -m tests.documents --fast [README...]  without the blocks marked slow; only these documents

Printed output stands in two kinds of fenced blocks, both run in a temporary copy of ``samples`` and ``robots``, in the
order of the document, from the top of the repository:

- ``console``: a line ``$ command``, run by bash, then what it prints on both streams.  A line that ends with a
  backslash goes on below, after ``> ``.  An exit code other than 0 is the last line: ``(exit code 3)``.
- ``pycon``: statements after ``>>> `` and ``... ``, in one interpreter for the block, and what they print.

``slow`` after the kind leaves a block to the slow tests.  A block is not compared where the paragraph above it says so
to the reader: ``*Not compared with a run: REASON.*``.  Any other block holds no output.

One rule masks what depends on machine and day, ``MASKS``; where nothing else differs ``--write`` keeps the old line.
"""

from __future__ import annotations

import argparse
import difflib
import doctest
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parent.parent

PRINTED = ("console", "pycon")
UNPRINTED = ("sh", "text", "yaml", "krl", "gcode", "csv", "python")

MASKS = [(re.compile(r"\b\d+(\.\d+)? s\b"), "# s"), (re.compile(r"\b20\d\d-\d\d-\d\d\b"), "DATE")]
"""Durations and dates: the only figures of a compared block that may differ between two runs."""

REASON = re.compile(r"\*Not compared with a run: \S.*\.\*", re.DOTALL)
FENCE = re.compile(r"^(`{3,})([^`\n]*)\n(.*?)^\1[ \t]*$", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A fenced block: ``start`` and ``stop`` of its text in the document, ``line`` of its fence, 1-based."""

    kind: str
    slow: bool
    compared: bool
    start: int
    stop: int
    line: int
    text: str


@dataclass(frozen=True)
class Drift:
    """A block that is not what its run prints."""

    document: Path
    block: Block
    printed: str

    def __str__(self) -> str:
        lines = difflib.unified_diff(
            self.block.text.splitlines(), self.printed.splitlines(), "document", "run", lineterm="", n=1
        )
        return "\n".join([f"{self.document}:{self.block.line}: the block is not what its run prints", *lines])


def list_documents(root: Path = ROOT) -> list[Path]:
    """All READMEs, relative to ``root``."""
    found = [
        root / "README.md",
        *(root / top / "README.md" for top in ("samples", "robots", "postproc", "tests")),
    ]
    found.append(root / "postproc" / "languages" / "README.md")
    found += sorted((root / "samples").glob("*/README.md"))
    return [path.relative_to(root) for path in found]


def read_blocks(text: str) -> list[Block]:
    """The fenced blocks of a document.  Raises ValueError on a kind that is none."""
    blocks = []
    for fence in FENCE.finditer(text):
        line = text.count("\n", 0, fence.start()) + 1
        kind, *marks = fence[2].split() or [""]
        if kind not in PRINTED + UNPRINTED or marks not in ([], ["slow"]):
            raise ValueError(
                f"line {line}: no kind of block: {fence[2]!r}; known: {', '.join(PRINTED + UNPRINTED)}"
            )
        above = text[: fence.start()].rstrip().rsplit("\n\n", 1)[-1]
        compared = kind in PRINTED and not REASON.fullmatch(above.strip())
        blocks.append(Block(kind, marks == ["slow"], compared, fence.start(3), fence.end(3), line, fence[3]))
    return blocks


def mask(text: str) -> str:
    """``text`` without what may differ between two runs."""
    for pattern, mark in MASKS:
        text = pattern.sub(mark, text)
    return text


def keep_masked_lines(old: str, new: str) -> str:
    """``new``, with the lines of ``old`` wherever a masked figure alone differs."""
    a, b = old.splitlines(keepends=True), new.splitlines(keepends=True)
    lines: list[str] = []
    matcher = difflib.SequenceMatcher(None, [mask(x) for x in a], [mask(x) for x in b], autojunk=False)
    for tag, i1, i2, j1, j2 in matcher.get_opcodes():
        lines += a[i1:i2] if tag == "equal" else b[j1:j2]
    return "".join(lines)


SAME_NUMBERS = {
    "OPENBLAS_CORETYPE": "Haswell",
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "NUMBA_CPU_NAME": "x86-64-v3",
    "NUMBA_CPU_FEATURES": "+avx2,+fma",
}
"""Of vector units the common ones: with others sums round otherwise, and of two equally good choices the other one is
made (a pose of a plan, the last of 8640 places)."""


@dataclass(frozen=True)
class Workplace:
    """A temporary copy of what the documents' commands work on."""

    folder: Path
    environment: dict[str, str]

    @classmethod
    def create(cls, folder: Path) -> Workplace:
        """A copy of samples and robots in ``folder``, with the commands ``compensate`` and ``python``."""
        folder = folder.resolve()
        for name in ("samples", "robots"):
            shutil.copytree(ROOT / name, folder / "work" / name, ignore=shutil.ignore_patterns("compensated"))
        programs = folder / "bin"
        programs.mkdir()
        for name, words in (("compensate", " -m postproc"), ("python", "")):
            (programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}"{words} "$@"\n')
            (programs / name).chmod(0o755)
        environment = {name: value for name, value in os.environ.items() if not name.startswith("POSTPROC_")}
        environment |= {
            "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
            "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests")]),
            "PYTHONDONTWRITEBYTECODE": "1",
            "LC_ALL": "C.UTF-8",
            "TZ": "UTC",
            **SAME_NUMBERS,
        }
        return cls(folder / "work", environment)

    def run(self, words: list[str], given: str = "") -> str:
        """What ``words`` print on both streams, with relative paths, and the exit code where it is not 0."""
        done = subprocess.run(
            words,
            cwd=self.folder,
            env=self.environment,
            input=given,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=1800,
            check=False,
        )
        printed = done.stdout.replace(f"{self.folder}/", "").replace(f"{ROOT}/", "")
        lines = [line.rstrip() for line in printed.splitlines()]
        if done.returncode:
            lines.append(f"(exit code {done.returncode})")
        return "".join(f"{line}\n" for line in lines)

    def run_block(self, block: Block) -> str:
        """The text of ``block`` with what its commands print now."""
        if block.kind == "pycon":
            return self._run_statements(block.text)
        parts = []
        for command in read_commands(block.text):
            script = "\n".join(line[2:] for line in command)
            parts.append("\n".join(command) + "\n" + self.run(["bash", "-c", script]))
        return "".join(parts)

    def _run_statements(self, text: str) -> str:
        """Each statement of an interactive session, and what it prints."""
        examples = doctest.DocTestParser().get_examples(text)
        statements = [example.source for example in examples]
        script = (
            "import sys\nnames = {'__name__': '__main__'}\n"
            f"for index, statement in enumerate({statements!r}):\n"
            "    print('\\0', flush=True)\n"
            "    exec(compile(statement, '<document>', 'single'), names)\n"
        )
        outputs = self.run([sys.executable, "-"], script).split("\0\n")[1:]
        parts = []
        for statement, output in zip(statements, outputs, strict=True):
            first, *others = statement.rstrip("\n").split("\n")
            parts += [f">>> {first}\n", *(f"... {line}\n" for line in others), output]
        return "".join(parts)


def read_commands(text: str) -> Iterator[list[str]]:
    """The lines of each command of a console block, with their ``$ `` and ``> ``.  Raises ValueError without one."""
    lines = text.splitlines()
    if not lines or not lines[0].startswith("$ "):
        raise ValueError("a console block begins with a command: $ ...")
    index = 0
    while index < len(lines):
        if lines[index].startswith("$ "):
            command = [lines[index]]
            while command[-1].endswith("\\"):
                index += 1
                command.append(lines[index])
            yield command
        index += 1


def find_drifts(document: Path, slow: bool, root: Path = ROOT) -> list[Drift]:
    """The blocks of ``document`` (relative to ``root``) that are not what their commands print now."""
    try:
        blocks = [b for b in read_blocks((root / document).read_text(encoding="utf-8")) if b.compared]
    except ValueError as error:
        raise ValueError(f"{document}: {error}") from error
    if not slow:
        blocks = [b for b in blocks if not b.slow]
    if not blocks:
        return []
    found = []
    with TemporaryDirectory(prefix="documents-") as folder:
        workplace = Workplace.create(Path(folder))
        for block in blocks:
            printed = workplace.run_block(block)
            if mask(printed) != mask(block.text):
                found.append(Drift(document, block, printed))
    return found


def rewrite(document: Path, drifts: Iterable[Drift], root: Path = ROOT) -> None:
    """Writes the document with what its commands print now.  Raises ValueError if it was edited since."""
    text = (root / document).read_text(encoding="utf-8")
    blocks = read_blocks(text)
    for drift in sorted(drifts, key=lambda one: one.block.start, reverse=True):
        block = drift.block
        if block not in blocks:
            raise ValueError(f"{document}:{block.line}: edited while its commands ran; run it again")
        text = text[: block.start] + keep_masked_lines(block.text, drift.printed) + text[block.stop :]
    (root / document).write_text(text, encoding="utf-8")


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.documents", description=__doc__.split("\n")[0])
    parser.add_argument("documents", nargs="*", type=Path, help="READMEs, relative to the repository [all]")
    parser.add_argument("--write", action="store_true", help="rewrite what has drifted")
    parser.add_argument("--fast", action="store_true", help="without the blocks marked slow")
    given = parser.parse_args(words)
    count = 0
    for document in given.documents or list_documents():
        drifts = find_drifts(document, slow=not given.fast)
        for drift in drifts:
            print(drift, end="\n\n")
        if given.write:
            rewrite(document, drifts)
        count += len(drifts)
    print(f"{count} blocks " + ("rewritten" if given.write else "have drifted"))
    return 1 if count and not given.write else 0


if __name__ == "__main__":
    sys.exit(main())
