"""The mirror iteration: where it ends, how fast it gets there, and what is left alone when it can not."""

from dataclasses import replace

import numpy as np
import pytest
from motions import load_of, milling_angles, motions
from plant import SOFTER, kr270, random_tools, random_wrenches, with_compensator
from scipy.optimize import brentq

from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.compensation.correct import MotionOutcome, correct
from postproc.compensation.cuts import number_cuts, spread_over_cuts
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import MAX_ITERATIONS, interpolate_pose, mirror, pose_error, predict
from postproc.compensation.problem import CompensationProblem
from postproc.model import NOTHING, StiffnessModel
from postproc.process import Wrenches
from postproc.robot.axis_track import follow_axes
from postproc.robot.chain import generalized_force
from postproc.robot.inverse import branch_of, inverse
from postproc.toolpath import Annotation, Kind

TOOL = Poses(rotation_from_vector([0.0, 0.5, 0.0]), np.array([0.12, 0.0, 0.25]))
NANOMETRES_10 = 1e-8


def full(**change):
    return with_compensator(StiffnessModel.from_robot(kr270()), **change)


def joints_only():
    return full().without_effects(["gravity_compensator"])


def softened(factor):
    """The joints ``factor`` times as soft, without the compensator."""
    model = joints_only()
    term = model.terms[0]
    values = {name: factor * value for name, value in term.values.items()}
    return replace(model, terms=(replace(term, values=values),))


class Problem:
    """Random milling poses with tools and wrenches, to be corrected to the wanted pose itself."""

    def __init__(self, model, count=200, seed=0):
        rng = np.random.default_rng(seed)
        self.model, self.near = model, milling_angles(count, rng)
        self.tool, self.wrench = random_tools(count, rng), random_wrenches(count, rng)
        self.wanted = model.chain.flange(self.near) @ self.tool
        self.branch = branch_of(model.robot.nominal, self.near)

    def mirror(self):
        return mirror(
            self.model,
            self.wanted,
            self.wanted,
            LoadCase(self.tool, self.wrench, NOTHING, self.branch, self.near),
        )

    def predict(self, command):
        return predict(self.model, command, LoadCase(self.tool, self.wrench, NOTHING, self.branch, self.near))


def stepped(command, shift, turn):
    return Poses(rotation_from_vector(turn) @ command.rotation, command.position + shift)


# where it ends


@pytest.mark.parametrize("model", [joints_only(), full(), full(**SOFTER), full(sign="as_printed")])
def test_the_predicted_tool_comes_to_the_wanted_pose(model):
    problem = Problem(model)
    done = problem.mirror()
    assert done.converged.all()
    there = problem.predict(done.command)
    shift, turn = pose_error(there.pose, problem.wanted)
    # an equilibrium leaves less than a nanometre
    assert np.linalg.norm(shift, axis=1).max() <= 1.1 * NANOMETRES_10
    assert np.linalg.norm(turn, axis=1).max() <= 1.1 * NANOMETRES_10
    assert np.array_equal(there.q, done.q)
    assert (
        np.linalg.norm(pose_error(problem.predict(problem.wanted).pose, problem.wanted)[0], axis=1).max()
        > 1e-3
    )


def test_history_is_the_error_of_each_iteration():
    problem = Problem(full(), 50)
    done = problem.mirror()
    steps = np.isfinite(done.history).sum(axis=0)
    assert np.array_equal(steps - 1, done.iterations)
    first = pose_error(problem.predict(problem.wanted).pose, problem.wanted)[0]
    np.testing.assert_allclose(done.history[0], np.linalg.norm(first, axis=1), rtol=1e-14)
    last = done.history[done.iterations, np.arange(50)]
    assert (last <= NANOMETRES_10).all()
    assert (done.iterations <= 5).all()


def test_one_motion_is_corrected_as_in_the_batch():
    problem = Problem(full(), 20)
    done = problem.mirror()
    for row in range(0, 20, 5):
        rows = slice(row, row + 1)
        alone = mirror(
            problem.model,
            problem.wanted[rows],
            problem.wanted[rows],
            LoadCase(
                problem.tool[rows], problem.wrench[rows], NOTHING, problem.branch[rows], problem.near[rows]
            ),
        )
        assert np.abs(alone.command.position - done.command.position[rows]).max() < 1e-12
        assert alone.iterations[0] == done.iterations[row]


# how fast


def test_rate_is_the_derivative_of_the_deflection():
    """e_next = -dD e with D = x_real(x) (-) x: D's derivative is taken here by central differences."""
    problem = Problem(full(**SOFTER), 60, seed=4)
    done = problem.mirror()

    def error(command):
        return np.concatenate(pose_error(problem.predict(command).pose, problem.wanted), axis=1)

    first = error(problem.wanted)
    # the step leads from the wanted pose by -first: the derivative belongs to the middle of it
    middle = stepped(problem.wanted, -first[:, :3] / 2, -first[:, 3:] / 2)
    derivative, step = np.empty((60, 6, 6)), 1e-4
    for column, unit in enumerate(np.eye(6)):
        up, down = (
            error(stepped(middle, sign * step * unit[:3], sign * step * unit[3:])) for sign in (1, -1)
        )
        derivative[:, :, column] = (up - down) / (2 * step)
    expected = np.einsum("nij,nj->ni", np.eye(6) - derivative, first)
    measured = done.history[1]
    assert np.abs(measured - np.linalg.norm(expected[:, :3], axis=1)).max() < 0.01 * measured.max()
    np.testing.assert_allclose(measured, np.linalg.norm(expected[:, :3], axis=1), rtol=0.05, atol=2e-8)

    # and no later step is slower than the largest gain of that derivative
    bound = np.linalg.norm(np.eye(6) - derivative, ord=2, axis=(1, 2))
    rate = fitted_rate(done.history)
    assert (rate < 1.5 * bound).all()
    assert np.median(rate) < 6e-3  # "2e-3 to 3e-3 on a large arm"; the tools here reach farther
    assert np.median(rate) > 3e-4


def fitted_rate(history):
    """(N,) slope of log(error) over the iterations, above the noise of rounding."""
    logs = np.log(np.where(history > 1e-12, history, np.nan))
    count = np.arange(len(history), dtype=float)[:, None] + 0 * logs
    x, y = count - np.nanmean(count, axis=0), logs - np.nanmean(logs, axis=0)
    return np.exp(np.nansum(x * y, axis=0) / np.nansum(x * x, axis=0))


def test_rate_grows_with_the_compliance():
    """The relative change of the deflection is proportional to it: ten times as soft, ten times the rate."""
    rates = [np.median(fitted_rate(Problem(softened(factor)).mirror().history)) for factor in (0.3, 3.0)]
    assert rates[1] / rates[0] == pytest.approx(10.0, rel=0.2)


# the closed form


def inverse_of(problem, goal):
    flange = goal @ problem.tool.inverse()
    return inverse(problem.model.robot.nominal, flange, problem.branch, problem.near).q


def motor_angles(model, goal_angles, tool, wrench):
    """Motors that bring the deflected coordinates to ``goal_angles``: explicit, but for A2 with a balanced spring."""
    swept = model.chain.evaluate(np.ascontiguousarray(goal_angles.T), tool)
    torque = generalized_force(swept, swept.position, wrench.T).T
    compliance = np.array([model.terms[0].values[f"c{i}"] for i in range(1, 7)])
    motors = goal_angles - compliance * torque
    for term in model.terms[1:]:
        for row, (angles, motor) in enumerate(zip(goal_angles, motors, strict=True)):

            def miss(a2, angles=angles, without=motor[1], term=term):
                stand = angles.copy()
                stand[1] = a2
                load = load_of(term.effect, term.values, model.robot, angles[:, None], stand[:, None])[0][
                    1, 0
                ]
                return a2 - (without - compliance[1] * load)

            motors[row, 1] = brentq(miss, motor[1] - 0.1, motor[1] + 0.1, xtol=1e-15)
    return motors


@pytest.mark.parametrize("model", [joints_only(), full(), full(**SOFTER)])
def test_deflected_joints_are_the_inverse_of_the_goal(model):
    """With all compliance in the joints and the nominal geometry, q + theta = IK(x_goal) whatever the force."""
    problem = Problem(model, 60, seed=9)
    done = problem.mirror()
    there = problem.predict(done.command)
    # one step more than its tolerance asks for, so that the rest of the iteration is not what is seen
    shift, turn = pose_error(there.pose, problem.wanted)
    command = stepped(done.command, -shift, -turn)
    rest = model.equilibrium(problem.predict(command).q, problem.wrench, problem.tool)
    goal_angles = inverse_of(problem, problem.wanted)
    assert np.abs(rest.coordinates - goal_angles).max() < 2e-9

    motors = motor_angles(model, goal_angles, problem.tool, problem.wrench)
    assert np.abs(problem.predict(command).q - motors).max() < 2e-9
    exact = model.chain.flange(motors) @ problem.tool
    assert np.abs(exact.position - done.command.position).max() < NANOMETRES_10
    assert np.abs(motors - goal_angles).max() > 1e-4


# what does not converge


@pytest.mark.sample(3)
@pytest.mark.parametrize("factor", [1.0, 30.0, 100.0, 300.0, 1000.0, 10000.0])
def test_a_robot_too_soft_is_never_called_done(factor):
    problem = Problem(softened(factor))
    done = problem.mirror()
    there = problem.predict(done.command)
    shift, turn = pose_error(there.pose, problem.wanted)
    error = np.maximum(np.linalg.norm(shift, axis=1), np.linalg.norm(turn, axis=1))
    good = done.converged
    assert there.settled[good].all()
    assert there.reachable[good].all()
    assert (error[good] <= NANOMETRES_10).all()
    assert not ((error <= NANOMETRES_10) & there.settled & ~good).any()
    assert np.isfinite(done.command.position).all()
    assert np.isfinite(done.command.rotation).all()
    assert (done.iterations[~good] < MAX_ITERATIONS).all()  # given up as soon as a step does not help
    assert good.all() if factor == 1.0 else True
    if factor >= 300.0:
        assert not good.all()
    if factor == 10000.0:
        assert good.mean() < 0.5


def test_unstable_spring_is_reported_as_no_rest():
    """A spring that pushes away faster than the joint holds; the same robot rests where it pulls back."""
    model = full(K_c=1e8)
    q = np.radians([[0.0, -15, 60, 0, 45, 0], [0.0, -100, 100, 0, 45, 0]] * 2)
    wrench = np.outer(
        [1.0, 1.0, 0.0, 0.0], [100.0, 0, 300, 0, 0, 0]
    )  # a pencil on its tip does not rest either
    wanted = model.chain.flange(q) @ TOOL
    done = mirror(model, wanted, wanted, LoadCase(TOOL, wrench, NOTHING, np.full(4, 2), q))
    assert done.settled.tolist() == [False, True] * 2
    assert done.converged.tolist() == [False, True] * 2
    assert done.reachable.all()


def test_out_of_reach_is_reported():
    model = full()
    wanted = Poses(np.eye(3)[None], np.array([[5.0, 0.0, 1.0]]))
    done = mirror(
        model, wanted, wanted, LoadCase(TOOL, np.ones((1, 6)), NOTHING, np.array([2]), np.zeros((1, 6)))
    )
    assert not done.reachable[0]
    assert not done.converged[0]


def test_partly_is_the_share_of_the_way():
    problem = Problem(full(), 20)
    command = problem.mirror().command
    for gain in (0.0, 0.25, 0.5, 1.0):
        share = interpolate_pose(problem.wanted, command, gain)
        shift, turn = pose_error(share, problem.wanted)
        whole_shift, whole_turn = pose_error(command, problem.wanted)
        np.testing.assert_allclose(shift, gain * whole_shift, atol=1e-15)
        np.testing.assert_allclose(turn, gain * whole_turn, atol=1e-14)


# correct(): cuts stand and fall as a whole.  Rows:  air  cut cut cut  air  cut cut cut  air

CARRIES = np.array([0, 1, 1, 1, 0, 1, 1, 1, 0], bool)
FORCE = np.array([-360.0, 100.0, 560.0, 0.0, 5.0, 0.0])
A, C, LEFT, OFF = MotionOutcome.AIR, MotionOutcome.CORRECTED, MotionOutcome.UNCORRECTED, MotionOutcome.OFF
ALL = [A, C, C, C, A, C, C, C, A]
FIRST_LEFT = [A, LEFT, LEFT, LEFT, A, C, C, C, A]


def program_angles():
    q = np.tile([5.0, -95.0, 110.0, 10.0, 50.0, 20.0], (9, 1))
    q[:, 0] += np.arange(9)
    return np.radians(q)


def task(
    q=None,
    model=None,
    carries=CARRIES,
    wrench=None,
    start=True,
    wanted=None,
    process=True,
    gain=1.0,
    max_correction=0.02,
    **words,
):
    q = program_angles() if q is None else q
    model = model or full()
    wanted = wanted or model.chain.flange(q) @ TOOL
    tool = Poses(np.tile(TOOL.rotation, (len(q), 1, 1)), np.tile(TOOL.position, (len(q), 1)))
    path = motions(wanted, **words)
    track = follow_axes(model.robot, path, wanted @ TOOL.inverse(), q[0] if start else None, None, tool)
    world = Poses(np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3)))
    wrench = np.where(carries[:, None], FORCE, 0.0) if wrench is None else wrench
    return CompensationProblem(
        file="part.src",
        toolpath=path,
        model=model,
        track=track,
        wanted=wanted,
        base=world,
        tool=tool,
        force=Wrenches(wrench, wrench, carries, "test", (), np.zeros(len(wrench), bool)),
        conditions=NOTHING,
        process=process,
        gain=gain,
        max_correction=max_correction,
        tolerance=2e-5,
        tolerance_angle=2e-4,
    )


def codes(result):
    return [finding.code for finding in result.findings]


def untouched(result, job, rows):
    """Exactly, to the bit: what is left is not even rounded."""
    return np.array_equal(
        result.command.position[rows], job.wanted.position[rows], equal_nan=True
    ) and np.array_equal(result.command.rotation[rows], job.wanted.rotation[rows], equal_nan=True)


def test_cuts_are_corrected_and_air_is_not_touched():
    job = task()
    result = correct(job)
    assert result.state.tolist() == ALL
    assert result.cut.tolist() == [-1, 0, 0, 0, -1, 1, 1, 1, -1]
    assert untouched(result, job, ~CARRIES)
    assert (np.linalg.norm(result.command.position - job.wanted.position, axis=1)[CARRIES] > 1e-4).all()
    assert (result.after[CARRIES] <= NANOMETRES_10).all()
    assert (result.after_angle[CARRIES] <= NANOMETRES_10).all()
    assert np.isnan(result.before[~CARRIES]).all()
    np.testing.assert_allclose(np.linalg.norm(result.deflection, axis=1)[CARRIES], result.before[CARRIES])
    assert result.findings == ()
    # what is claimed is what the model says of the commands
    job_rows = np.flatnonzero(CARRIES)
    rest = predict(
        job.model,
        result.command[job_rows],
        LoadCase(TOOL, job.wrench[job_rows], NOTHING, job.track.branch[job_rows], job.track.q[job_rows]),
    )
    assert np.linalg.norm(rest.pose.position - job.wanted.position[job_rows], axis=1).max() <= NANOMETRES_10


@pytest.mark.parametrize("row", [1, 2, 3])
@pytest.mark.parametrize("words", ["refused", "locked"])
def test_a_refused_or_pinned_motion_leaves_its_whole_cut_and_only_its_cut(words, row):
    job = task(**{words: {row: Finding("KRL007", "serves several places", "part.src", 10 + row)}})
    result = correct(job)
    assert result.state.tolist() == FIRST_LEFT
    assert untouched(result, job, [0, 1, 2, 3, 4, 8])
    assert codes(result) == ["COR003"]
    told = result.findings[0]
    assert "lines 11 to 13 (3 motions)" in told.message
    assert f"line {10 + row}: KRL007 serves several places" in told.message
    assert told.line == 11
    # where it can be predicted it is: the report says what the cut would need
    assert np.isfinite(result.before[CARRIES]).all()
    np.testing.assert_array_equal(result.after[1:4], result.before[1:4])


def test_refused_air_blocks_nothing():
    assert correct(task(refused={4: Finding("KRL007", "x")})).state.tolist() == ALL


def test_motion_beyond_the_limits_leaves_its_cut():
    q = program_angles()
    q[:, 0] += np.radians(170.0)
    q[2, 0] = np.radians(185.5)
    result = correct(task(q, max_correction=1.0))
    assert result.state.tolist() == FIRST_LEFT
    assert codes(result) == ["KIN002", "COR003"]
    assert "A1 is at 185.5 deg" in result.findings[0].message
    assert "KIN002" in result.findings[1].message


def pushed_against_a1(q, row, newtons):
    """Wrenches as in the program, at ``row`` one that turns A1 back by its compliance."""
    wrench = np.where(CARRIES[:, None], FORCE, 0.0)
    column = full().chain.jacobian(q[row : row + 1], TOOL)[0, :3, 0]
    wrench[row] = np.concatenate([-newtons * column / np.linalg.norm(column), np.zeros(3)])
    return wrench


def test_correction_that_would_leave_the_limits_leaves_its_cut():
    q = program_angles()
    q[:, 0] += np.radians(170.0)
    q[2, 0] = np.radians(185.0) - 1e-6
    back = correct(task(q, wrench=pushed_against_a1(q, 2, 300.0)))
    assert back.state.tolist() == FIRST_LEFT
    assert codes(back) == ["COR008", "COR003"]
    forth = correct(task(q, wrench=pushed_against_a1(q, 2, -300.0)))
    assert forth.state.tolist() == ALL


def test_correction_out_of_reach_leaves_its_cut():
    """An arm 3 mm shorter than its controller believes: at the end of its reach nothing makes up for it."""
    model = full()
    robot = model.robot
    short = replace(robot.arm, a2=robot.arm.a2 - 0.003)
    names, limits = [j.name for j in robot.joints], [(j.lower, j.upper) for j in robot.joints]
    shorter = replace(model, robot=replace(robot, arm=short, joints=short.joints(names, limits)))
    q = program_angles()
    q[2, 1:3] = np.radians([-20.0, -2.86 + 0.5])
    wanted = model.chain.flange(q) @ TOOL
    job = task(q, model=shorter, wanted=wanted, process=False)
    result = correct(job)
    assert result.state.tolist() == [C, LEFT, LEFT, LEFT, C, C, C, C, C]
    assert codes(result)[:2] == ["COR009", "COR003"]
    assert untouched(result, job, [1, 2, 3])


def test_motion_without_a_rest_leaves_its_cut():
    q = program_angles()
    q[2, 1:3] = np.radians([-15.0, 60.0])
    result = correct(task(q, model=full(K_c=1e8)))
    assert result.state.tolist() == FIRST_LEFT
    assert codes(result) == ["MOD002", "COR003"]
    assert np.isnan(result.before[2])


def test_motion_that_does_not_settle_leaves_its_cut():
    wrench = np.where(CARRIES[:, None], FORCE, 0.0)
    wrench[2] *= 300.0
    job = task(wrench=wrench, model=joints_only())
    result = correct(job)
    assert result.state.tolist() == FIRST_LEFT
    assert codes(result)[0] in ("COR001", "COR009", "MOD002")
    assert "COR003" in codes(result)
    assert untouched(result, job, [1, 2, 3])


def test_a_motion_of_unknown_target_leaves_its_cut_even_if_nobody_says_why():
    job = task()
    position = job.wanted.position.copy()
    position[2] = np.nan
    job = task(wanted=Poses(job.wanted.rotation, position))
    result = correct(job)
    assert result.state.tolist() == FIRST_LEFT
    assert "COR003" in codes(result)
    assert untouched(result, job, [0, 1, 2, 3, 4, 8])


def switch(*pairs):
    return tuple(Annotation(row, text, 10 + row) for row, text in pairs)


@pytest.mark.parametrize("rows", [(2, 3), (2, 4), (3, 5), (0, 3)])
def test_switching_off_inside_a_cut_leaves_it(rows):
    job = task(annotations=switch((rows[0], "COMPENSATE OFF"), (rows[1], "compensate on")))
    result = correct(job)
    assert C not in result.state[1:4]
    assert LEFT in result.state[1:4]
    assert result.state[4:].tolist() == ALL[4:]
    assert codes(result) == ["COR003"]
    assert "COR004" in result.findings[0].message
    assert untouched(result, job, [0, 1, 2, 3, 4, 8])


def test_switching_off_around_a_cut_is_silent():
    job = task(annotations=switch((0, "COMPENSATE OFF"), (4, "COMPENSATE ON")))
    result = correct(job)
    assert result.state.tolist() == [A, OFF, OFF, OFF, A, C, C, C, A]
    assert result.findings == ()
    assert untouched(result, job, [0, 1, 2, 3, 4, 8])
    # it is still predicted, and a motion in it that could not be corrected is no matter
    assert np.isfinite(result.before[1:4]).all()
    words = {"annotations": job.toolpath.annotations, "refused": {2: Finding("KRL007", "x")}}
    assert correct(task(**words)).findings == ()


def refusal(job):
    with pytest.raises(Refusal) as caught:
        correct(job)
    return caught.value.findings[0]


def test_too_large_a_correction_is_refused():
    largest = 1e3 * np.linalg.norm(correct(task()).command.position - task().wanted.position, axis=1).max()
    finding = refusal(task(max_correction=largest * 0.9e-3))
    assert finding.code == "COR002"
    assert f"{largest:.2f} mm" in finding.message
    assert finding.line >= 11
    assert correct(task(max_correction=largest * 1.1e-3)).state.tolist() == ALL


def test_unknown_configuration_is_refused():
    finding = refusal(task(start=False))
    assert finding.code == "KIN004"
    assert finding.line == 11
    q = program_angles()
    assert correct(task(start=False, axes={0: q[0]})).state.tolist() == ALL
    # S says the branch, and enough of the turns
    kinds = [Kind.PTP] + [Kind.LIN] * 8
    assert correct(task(start=False, kind=kinds, status=2, turn=0b000010)).state.tolist() == ALL


@pytest.mark.parametrize("process", [True, False])
def test_cutting_pose_out_of_reach_is_refused(process):
    wanted = task().wanted
    position = wanted.position.copy()
    position[2] += [3.0, 0.0, 0.0]
    finding = refusal(task(wanted=Poses(wanted.rotation, position), process=process))
    assert finding.code == "KIN001"
    assert finding.line == 12


def test_air_out_of_reach_is_told_and_left():
    wanted = task().wanted
    position = wanted.position.copy()
    position[4] += [3.0, 0.0, 0.0]
    job = task(wanted=Poses(wanted.rotation, position))
    result = correct(job)
    assert result.state.tolist() == ALL
    assert codes(result) == ["KIN005"]
    result = correct(replace(job, process=False))
    assert result.state.tolist() == [C, C, C, C, LEFT, C, C, C, C]
    assert untouched(result, job, [4])
    assert codes(result)[0] == "KIN005"


def test_near_a_singularity_is_told():
    q = program_angles()
    q[6, 4] = np.radians(0.5)
    result = correct(task(q))
    assert "KIN003" in codes(result)
    told = next(finding for finding in result.findings if finding.code == "KIN003")
    assert told.line == 16


def test_s_and_t_that_no_longer_hold_are_told():
    """A PTP in a cut with S and T beside it, A6 a hair above zero: the correction takes it below."""
    q = program_angles()
    model = full()
    turned = model.chain.jacobian(q[1:2], TOOL)[0, 3:, 5]
    wrench = np.where(CARRIES[:, None], FORCE, 0.0)
    wrench[1] = np.concatenate([np.zeros(3), 50.0 * turned])
    q[1, 5] = 1e-6
    words = {"kind": [Kind.LIN, Kind.PTP] + [Kind.LIN] * 7, "status": 2, "turn": 0b000010}
    assert "KIN006" in codes(correct(task(q, model=model, wrench=wrench, **words)))
    assert "KIN006" not in codes(correct(task(q, model=model, wrench=-wrench, **words)))


@pytest.mark.parametrize("gain", [0.0, 0.5, 1.0])
def test_gain_is_the_share_that_is_corrected(gain):
    job = task(gain=gain)
    result = correct(job)
    assert result.state.tolist() == ALL
    rows = np.flatnonzero(CARRIES)
    np.testing.assert_allclose(
        result.after[rows], (1 - gain) * result.before[rows], rtol=0.01, atol=NANOMETRES_10
    )
    assert (result.before[rows] > 1e-4).all()
    if gain == 0.0:
        assert untouched(result, job, slice(None))


def test_process_keeps_the_sag_and_absolute_removes_it():
    """A compensator that acts bends the robot before any force; only the absolute correction is to take that away."""
    model = full(**SOFTER)
    process, absolute = task(model=model), task(model=model, process=False)
    still = np.zeros((9, 6))

    def real(job, command, wrench):
        return predict(
            model, command, LoadCase(job.tool, wrench, NOTHING, job.track.branch, job.track.q)
        ).pose

    sagged = real(process, process.wanted, still)
    sag = np.linalg.norm(sagged.position - process.wanted.position, axis=1)
    assert (sag > 5e-4).all()

    kept = correct(process)
    cut = np.flatnonzero(CARRIES)
    shift, turn = pose_error(real(process, kept.command[:], process.wrench)[cut], sagged[cut])
    assert np.abs(shift).max() <= NANOMETRES_10
    assert np.abs(turn).max() <= NANOMETRES_10
    assert untouched(kept, process, ~CARRIES)

    removed = correct(absolute)
    assert removed.state.tolist() == [C] * 9
    shift, turn = pose_error(real(absolute, removed.command[:], absolute.wrench), absolute.wanted)
    assert np.abs(shift).max() <= NANOMETRES_10
    assert np.abs(turn).max() <= NANOMETRES_10
    np.testing.assert_allclose(removed.before[~CARRIES], sag[~CARRIES], rtol=1e-9)


def test_absolute_correction_without_any_force():
    """No motion of an air program depends on another: one that stays leaves the others alone."""
    nothing = np.zeros(9, bool)
    words = {"model": full(**SOFTER), "carries": nothing, "process": False}
    result = correct(task(**words, refused={4: Finding("KRL007", "x")}))
    assert result.state.tolist() == [C, C, C, C, LEFT, C, C, C, C]
    assert correct(task(carries=nothing)).state.tolist() == [A] * 9


# cuts


def test_cuts_are_the_runs_of_forced_motions():
    scope = np.array([1, 1, 0, 1, 0, 0, 1], bool)
    assert number_cuts(scope).tolist() == [0, 0, -1, 1, -1, -1, 2]
    assert number_cuts(np.zeros(3, bool)).tolist() == [-1, -1, -1]
    assert number_cuts(np.zeros(0, bool)).tolist() == []
    # what does not follow is a cut of its own
    continues = np.array([True, True, True, True, False, False, True])
    assert number_cuts(np.ones(7, bool), continues).tolist() == [0, 0, 0, 0, 1, 2, 2]


def test_spread_reaches_the_cut_and_no_farther():
    cut = np.array([0, 0, -1, 1, -1, 2, 2])
    blocked = np.zeros(7, bool)
    assert not spread_over_cuts(blocked, cut).any()
    blocked[1] = True
    assert spread_over_cuts(blocked, cut).tolist() == [True, True, False, False, False, False, False]
    blocked[:] = [False, False, True, False, False, False, True]
    assert spread_over_cuts(blocked, cut).tolist() == [False] * 5 + [True] * 2
