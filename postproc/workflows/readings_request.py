"""What is asked for with readings of a robot, whatever is made of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from postproc.base.findings import Finding, Refusal
from postproc.base.input_files import place


@dataclass(frozen=True)
class ReadingsRequest:
    """``data``: files of readings; ``robot``: None takes the one that they name; ``output``: the new robot file;
    ``validate``: files of readings that are predicted only; ``tool_mm_deg``: TCP on the flange where no file states it;
    ``picture``, ``page``, ``csv``, ``json``: where results go; ``strict``: warnings count as errors."""

    data: tuple[Path, ...]
    robot: str | None = None
    output: Path | None = None
    validate: tuple[Path, ...] = ()
    tool_mm_deg: tuple[float, ...] | None = None
    picture: Path | None = None
    page: Path | None = None
    csv: Path | None = None
    json: Path | None = None
    strict: bool = False

    @property
    def written(self) -> list[Path]:
        """The files that are to be written."""
        outputs = (self.output, self.json, self.csv, self.picture, self.page)
        return [path for path in outputs if path is not None]


def spare_inputs(request: ReadingsRequest) -> None:
    """Raises Refusal FIL007 where a result would replace an input, or another result."""
    inputs = {place(path) for path in (*request.data, *request.validate)}
    if request.robot and request.robot.endswith((".yaml", ".yml")):
        inputs.add(place(Path(request.robot)))
    written = request.written
    for path in written:
        if place(path) in inputs:
            raise Refusal(Finding("FIL007", "the output would replace an input", str(path)))
    if len({place(path) for path in written}) < len(written):
        raise Refusal(Finding("FIL007", "two results have the same name", str(written[0])))
