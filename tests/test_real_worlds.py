"""A small fixed part of ``python -m tests.blind.real_command``: readings as shops take them."""

import pytest
from blind import command, real_command


@pytest.fixture(scope="module")
def diagnosed():
    """``diagnosed(row, number, seed)``: the trial, what is counted of it, and the answer."""
    process = command.Diagnosing()

    def run(row, number, seed=1):
        trial = real_command.ALL[row](number, seed)
        return trial, *real_command.run(trial, process)

    yield run
    process.close()


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1, 8, 10, 11])
def test_a_wrong_length_is_named_as_that_length(diagnosed, number):
    """Not as millimetres and milliradians that cancel, however the scatter is stated."""
    _, held, answer = diagnosed("length", number)
    assert answer["verdict"] == answer["other"] == "named"
    assert held["named or in the set"]
    assert not held["a name that is wrong"]
    assert not held["shift or zero above 1 mm, 1 mrad"]
    assert held["gap closed"] > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 5, 8])
def test_a_scale_of_the_tracker_is_no_effect(diagnosed, number):
    trial, _, answer = diagnosed("scale", number)
    assert answer["verdict"] == "nothing_missing"
    truth = 1e-6 * float(trial.words.split()[1])
    assert abs(answer["tracker_scale"] - truth) < 0.5 * abs(truth) + 2e-5


@pytest.mark.sample(1)
@pytest.mark.parametrize("number", [0, 1])
def test_twins_are_never_a_name_and_correct_the_same(diagnosed, number):
    _, held, answer = diagnosed("twin", number)
    assert answer["verdict"] == "ambiguous"
    assert answer["same_correction"]
    assert answer["named"] == []
    assert held["truth in the set"]
    assert held["file written"]
    assert held["stated disagreement is true"]


@pytest.mark.slow
@pytest.mark.parametrize("number", [3, 7, 15])
def test_sides_that_are_not_stated(diagnosed, number):
    _, held, answer = diagnosed("approach", number)
    assert held["named or in the set"]
    assert "DIA003" in {finding["code"] for finding in answer["findings"]}


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("number", "code"), [(0, "MEA011"), (1, "IDN034"), (2, "MEA010")], ids=["zeros", "shifted", "columns"]
)
def test_files_as_they_are_written(diagnosed, number, code):
    _, _, answer = diagnosed("lost", number)
    assert code in {finding["code"] for finding in answer["findings"]}
    assert answer["verdict"] == ("refused" if code == "IDN034" else "nothing_missing")


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 3])
def test_stations_of_one_mounting(diagnosed, number):
    """Number 3 mounts its reflector anew between sessions."""
    _, held, answer = diagnosed("stations", number)
    assert held["gap closed"] > 0.95
    assert len(answer["stations"]) == 2
    remounted = "IDN032" in {finding["code"] for finding in answer["findings"]}
    assert remounted == (number == 3)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(4))
def test_what_no_library_has_gets_no_name(diagnosed, number):
    _, held, answer = diagnosed("strange", number)
    assert held["nothing named"]
    assert answer["verdict"] == "unknown"


@pytest.mark.slow
def test_a_sag_without_a_stiffness_is_found_joint_by_joint(diagnosed):
    _, held, answer = diagnosed("sag", 1)
    assert answer["verdict"] == "named"
    names = real_command.pairs(answer)
    assert {name for name, _ in names} == {"gravity_sag"}
    assert {("gravity_sag", "A2"), ("gravity_sag", "A3")} <= names
    assert held["gap closed"] > 0.95


@pytest.mark.slow
def test_a_weight_that_is_hung_shows_the_stiffness_beside_the_sag(diagnosed):
    _, held, answer = diagnosed("soft", 1)
    assert not held["a name that is wrong"]
    names = real_command.pairs(answer)
    assert {("gravity_sag", "A2"), ("gravity_sag", "A3"), ("joint_compliance", "A2")} <= names
    assert held["gap closed"] > 0.95


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1, 4])
def test_a_wrong_length_shows_beside_a_large_sag(diagnosed, number):
    """A hundredth of what the sag does, and most of what that leaves."""
    _, held, answer = diagnosed("soft", number, seed=77)
    assert answer["verdict"] == "named"
    assert "link_geometry" in {name for name, _ in real_command.pairs(answer)}
    assert not held["a name that is wrong"]
    assert held[real_command.NEW_OVER_OLD] < 0.05


@pytest.mark.slow
def test_reflectors_that_moved_less_than_a_wrong_geometry_misses(diagnosed):
    _, held, answer = diagnosed("remounted", 5)
    assert "IDN032" in {finding["code"] for finding in answer["findings"]}
    assert held["gap closed"] > 0.95


@pytest.mark.slow
def test_sides_of_a_deflection_are_read_from_the_middle_of_the_gap(diagnosed):
    """Loaded minus unloaded: where the gear was on the load's side already, nothing moves."""
    _, held, answer = diagnosed("approach", 2, seed=2)
    assert answer["verdict"] == "named"
    assert held["named or in the set"]
    assert held["gap closed"] > 0.9


@pytest.mark.slow
def test_a_weight_at_the_edge_of_a_gap_stays_as_stated(diagnosed):
    """Which poses change sides allows weights between two values, whatever the derivative at either says."""
    _, held, answer = diagnosed("approach", 0, seed=2)
    assert held["named or in the set"]
    assert answer["refitted"] == []
    assert held[real_command.NEW_OVER_OLD] < 0.5


@pytest.mark.slow
def test_a_wave_of_another_order_is_no_harmonic(diagnosed):
    _, held, answer = diagnosed("remainder", 1, seed=2)
    assert answer["verdict"] == "partly_named"
    assert real_command.pairs(answer) == {("link_geometry", "A3")}
    assert held["gap closed"] > 0.9


@pytest.mark.slow
def test_rows_shifted_from_the_first_sixth_on(diagnosed):
    _, _, answer = diagnosed("lost", 1, seed=2)
    assert "IDN034" in {finding["code"] for finding in answer["findings"]}


@pytest.mark.slow
def test_a_small_sample_gives_no_further_names(diagnosed):
    """23 poses: what looks like a wave of A1, or like the play of its gear, is chance."""
    _, held, answer = diagnosed("stations", 0, seed=101)
    assert answer["verdict"] == "named"
    assert {name for name, _ in real_command.pairs(answer)} == {"link_geometry", "joint_offset"}
    assert not held["a set without truth"]


@pytest.mark.slow
def test_waves_beside_a_geometry_explain_no_hose(diagnosed):
    """A hose on an arm of five axes: waves of all gears explain it together with the geometry of all joints or other
    waves only."""
    _, held, answer = diagnosed("unknown", 22, seed=3)
    assert answer["verdict"] == "unknown"
    assert answer["named"] == []
    assert not held["file written"]


@pytest.mark.slow
@pytest.mark.parametrize("number", [2, 3, 4, 7, 10])
def test_other_arms(diagnosed, number):
    """Five axes, an arm on a rail, one of 235 kg, a cobot: judged by plain matrices."""
    _, held, _ = diagnosed("arms", number, seed=3)
    assert held["named or in the set"]
    assert not held["a name that is wrong"]
    assert held["gap closed"] > 0.8
