"""The post-processor files for CAM systems, in place of each system what its documentation says of it.

FreeCAD itself runs in ``test_posts_freecad.py``.  RoboDK's posts come with RoboDK only; the base post here has the
interface of its documentation (robodk.com/doc/en/PythonAPI/postprocessor.html) and the pages of its posts for KUKA.
"""

import importlib.util
import json
import os
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
from conftest import CELL

from postproc.posts import POSTS, post_file

COMMAND = Path(sys.executable).with_name("compensate")


def load(system, monkeypatch, **others):
    """A post as its system loads it, with the modules that it finds there."""
    for name, module in others.items():
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location(f"posted_by_{system}", post_file(system))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# The command.


def test_a_post_is_printed_or_put_where_it_belongs(compensate, tmp_path):
    listed = compensate("posts")
    assert [line.split() for line in listed.out.splitlines()] == [[s, file] for s, file in POSTS.items()]
    for system, file in POSTS.items():
        content = post_file(system).read_bytes()
        assert compensate("posts", system).out.encode() == content
        done = compensate("posts", system, "-o", tmp_path)
        assert (done.code, done.out) == (0, f"wrote {tmp_path / file}\n")
        assert (tmp_path / file).read_bytes() == content


def test_an_edited_post_is_replaced_where_it_is_asked_for_alone(compensate, tmp_path):
    for system, file in POSTS.items():
        content, target = post_file(system).read_bytes(), tmp_path / file
        edited = content + b"# mine\n"
        target.write_bytes(edited)
        done = compensate("posts", system, "-o", tmp_path)
        assert done.code == 1
        assert "FIL017" in done.err
        assert target.read_bytes() == edited
        assert compensate("posts", system, "-o", tmp_path, "--replace").code == 0
        assert target.read_bytes() == content
        assert compensate("posts", system, "-o", tmp_path).code == 0
    assert compensate("posts", "freecad", "--replace").code == 2


def test_no_folder_is_made_for_a_post(compensate, tmp_path):
    done = compensate("posts", "freecad", "-o", tmp_path / "macros")
    assert done.code == 2
    assert "does not exist" in done.err
    assert not (tmp_path / "macros").exists()


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no folder that takes no file")
def test_a_folder_that_takes_no_file_is_told(compensate):
    done = compensate("posts", "freecad", "-o", "/proc")
    assert done.code == 1
    assert "nothing is written" in done.err


# FreeCAD.


def value(number):
    return SimpleNamespace(Value=number)


def operation(label, lines, **properties):
    """An operation of FreeCAD with a cutter of 10 mm, and its lines as they are posted."""
    tool = SimpleNamespace(Diameter=value(10.0), Flutes=2)
    control = SimpleNamespace(Tool=tool, SpindleSpeed=9000.0, SpindleDir="Forward")
    own = {
        "StartDepth": value(0.0),
        "StepDown": value(4.0),
        "StepOver": 50,
        "CutMode": "Climb",
        "OffsetPattern": "Offset",
    }
    own |= {"ToolController": control, "Active": True, **properties}
    return SimpleNamespace(
        Label=label, posted=lines, **{key: one for key, one in own.items() if one is not None}
    )


SLOPES = [
    "G0 X0 Y0 Z5",
    "G1 Z-4 F100",
    "G1 X50 F900",
    "G1 X60 Z-6",
    "G1 X90",
    "G0 Z5",
    "G0 X0",
    "G1 Z-4",
    "G1 X9",
]


@pytest.fixture
def freecad(tmp_path, monkeypatch):
    """``post(*operations, arguments)``: rows of the process file, or the error."""

    def export(objects, file, words):
        text = "".join(
            "\n".join([f"(begin operation: {o.Label})", *o.posted, f"(finish operation: {o.Label})", ""])
            for o in objects
            if o.Active
        )
        Path(file).write_text(text)
        return text

    linuxcnc = ModuleType("linuxcnc_post")
    linuxcnc.export = export
    said = []
    console = SimpleNamespace(**{f"Print{kind}": said.append for kind in ("Error", "Warning", "Message")})
    monkeypatch.setattr("importlib.reload", lambda module: module)
    post = load("freecad", monkeypatch, FreeCAD=SimpleNamespace(Console=console), linuxcnc_post=linuxcnc)
    (tmp_path / "stand_in.py").write_text(
        "import shutil, sys\nprint('said', *sys.argv[2:])\nshutil.copy(sys.argv[1], sys.argv[4])\n"
    )
    known = f"--compensate '{sys.executable} {tmp_path / 'stand_in.py'}' --material steel --helix 30"

    def run(*operations, arguments=known):
        target = tmp_path / "out.ngc"
        target.write_text("(old)\n")
        try:
            text = post.export(list(operations), str(target), arguments)
        except RuntimeError as error:
            assert not target.exists()
            return str(error)
        assert target.read_text() == text
        rows = (tmp_path / "uncompensated" / "out.process.yaml").read_text().splitlines()[1:]
        return [json.loads(row.partition("- ")[2].rpartition("  #")[0]) for row in rows]

    return SimpleNamespace(run=run, known=known, said=said, folder=tmp_path, post=post)


def cuts(rows, *keys):
    return [tuple(row.get(key) for key in keys) for row in rows]


def test_lines_and_depths_follow_the_heights(freecad):
    """A ramp belongs to no height; going up again starts at the start depth; no cut is deeper than the step."""
    rows = freecad.run(operation("A", SLOPES))
    assert cuts(rows, "lines", "axial_depth") == [([4, 4], 4.0), ([6, 6], 2.0), ([10, 10], 4.0)]
    deep = ["G0 X0 Y0 Z5", "G1 Z-9 F100", "G1 X50"]
    assert cuts(freecad.run(operation("A", deep)), "lines", "axial_depth") == [([4, 4], 4.0)]
    air = ["G0 X0 Y0 Z5", "G1 Z2 F100", "G1 X50", "G1 Z-1", "G1 X0"]
    assert cuts(freecad.run(operation("A", air)), "lines", "axial_depth") == [([6, 6], 1.0)]


def test_each_operation_has_its_own_cut(freecad):
    two = ["G0 X0 Y0 Z5", "G1 Z-2 F100", "G1 X50 F900"]
    below = SimpleNamespace(
        Label="Dressed", Active=True, posted=two, Base=operation("B", [], CutMode="Conventional")
    )
    rows = freecad.run(
        operation("A", two),
        operation("off", two, Active=False),
        below,
        operation("full", two, StepOver=100),
        operation("drill", ["G0 X5 Y5 Z5", "G81 Z-9 R1 F100"]),
    )
    keys = ("lines", "direction", "radial_width", "axial_depth", "teeth", "diameter", "spindle")
    assert cuts(rows, *keys) == [
        ([4, 4], "down", 5.0, 2.0, 2, 10.0, 9000.0),
        ([9, 9], "up", 5.0, 2.0, 2, 10.0, 9000.0),
        ([14, 14], "slot", None, 2.0, 2, 10.0, 9000.0),
    ]
    assert any("drill cuts nothing at one height" in words for words in freecad.said)


def test_what_a_profile_does_not_state_is_stated_in_the_arguments(freecad):
    profile = operation("Profile (1)", SLOPES, StepOver=None, CutMode=None, OffsetPattern=None)
    assert '--cut "Profile (1)=down,4"' in freecad.run(profile)
    rows = freecad.run(profile, arguments=freecad.known + " --cut 'Profile (1)=up,1.5'")
    assert set(cuts(rows, "direction", "radial_width")) == {("up", 1.5)}
    rows = freecad.run(profile, arguments=freecad.known + " --cut 'Profile (1)=slot'")
    assert set(cuts(rows, "direction", "radial_width")) == {("slot", None)}
    for wrong in (
        "Profile (1)=down",
        "Profile (1)=slot,2",
        "down,2",
        "Profile (1)=left,2",
        "Profile (1)=up,x",
    ):
        assert "not posted" in freecad.run(profile, arguments=f"{freecad.known} --cut '{wrong}'")


@pytest.mark.parametrize(
    ("properties", "words"),
    [
        ({"OffsetPattern": "ZigZag"}, "back and forth"),
        ({"CutMode": "Other"}, "direction and radial width"),
        ({"StartDepth": None, "StepDown": None}, "neither a start depth"),
    ],
)
def test_a_job_that_does_not_state_enough_is_refused(freecad, properties, words):
    assert words in freecad.run(operation("A", ["G0 X0 Y0 Z5", "G1 Z-2 F100", "G1 X50 F900"], **properties))


@pytest.mark.parametrize("name", ["ClearingPattern", "CutPattern"])
def test_patterns_of_other_operations_and_versions_count(freecad, name):
    """FreeCAD 1.0 has another name for the pattern of a pocket, surfaces have one of their own."""
    lines = ["G0 X0 Y0 Z5", "G1 Z-2 F100", "G1 X50 F900"]
    assert "back and forth" in freecad.run(operation("A", lines, OffsetPattern=None, **{name: "ZigZag"}))
    assert len(freecad.run(operation("A", lines, OffsetPattern=None, **{name: "Offset"}))) == 1


@pytest.mark.parametrize("argument", ["", "--inch"])
def test_the_unit_is_that_of_the_posted_program(freecad, argument):
    lines = ["G20", "G0 X0 Y0 Z5", "G1 Z-0.1 F100", "G1 X50 F900", "G21", "G1 X60", "G1 Z-3", "G1 X0"]
    rows = freecad.run(operation("A", lines), arguments=f"{freecad.known} {argument}")
    assert cuts(rows, "axial_depth") == [(2.54,), (0.46,)]


def test_holes_of_a_cycle_are_no_cuts(freecad):
    holes = [
        "G1 X0 Y0 Z5 F100",
        "G81 X5 Y5 Z-3 R1 F100",
        "X15",
        "X25",
        "G80",
        "G0 Z5",
        "X0",
        "G1 Z-2",
        "G1 X50",
    ]
    rows = freecad.run(operation("A", holes))
    assert cuts(rows, "lines", "axial_depth") == [([10, 10], 2.0)]


@pytest.mark.parametrize("shape", ["ballend", "bullnose", "v-bit", "drill001"])
@pytest.mark.parametrize("name", ["ShapeName", "ShapeType"])
def test_the_force_of_a_tool_that_is_no_end_mill_has_to_be_stated(freecad, name, shape):
    one = operation("A", SLOPES)
    setattr(one.ToolController.Tool, name, shape)
    assert f"its tool is a {shape}" in freecad.run(one)
    setattr(one.ToolController.Tool, name, "endmill001")
    assert len(freecad.run(one)) == 3


def test_a_cut_of_no_operation_is_refused(freecad):
    words = freecad.run(operation("Pocket", SLOPES), arguments=f"{freecad.known} --cut 'Pocket1=up,2'")
    assert "no such operation; it has Pocket" in words


def test_a_version_that_states_no_file_is_told(freecad):
    with pytest.raises(RuntimeError, match=r"0\.20 and 0\.21"):
        freecad.post.export([operation("A", SLOPES)], "-", freecad.known)


def test_a_spindle_that_turns_back_is_refused(freecad):
    one = operation("A", SLOPES)
    one.ToolController.SpindleDir = "Reverse"
    assert "does not turn forward" in freecad.run(one)


@pytest.mark.parametrize("arguments", ["--helix x", "--no-comments", "'", "--cut"])
def test_wrong_arguments_are_told_and_freecad_lives(freecad, arguments):
    assert "not posted" in freecad.run(operation("A", SLOPES), arguments=f"{freecad.known} {arguments}")


def test_the_command_gets_what_the_arguments_say(freecad):
    freecad.run(
        operation("A", SLOPES), arguments=freecad.known + " --gain 0.5 --robot kuka_kr270 --cell c.yaml"
    )
    said = "".join(freecad.said)
    assert "--cell c.yaml --robot kuka_kr270 --gain 0.5" in said
    assert f"--force={freecad.folder / 'uncompensated' / 'out.process.yaml'}" in said


# RoboDK.


class KukaPost:
    """A post for KUKA as RoboDK has them: pages of some lines, each written by ``progsave``."""

    PROG_EXT, MAX_LINES_X_PROG = "src", 2500
    PROG_LIST = ()

    def __init__(self, robotpost=None, robotname=None, robot_axes=6, **kwargs):
        self.MAX_LINES_X_PROG = kwargs.get("lines_x_prog", self.MAX_LINES_X_PROG)
        self.PROG, self.PROG_LIST, self.PROG_FILES = [], [], []

    def ProgStart(self, progname):
        self.addline(f"DEF {progname} ( )")

    def ProgFinish(self, progname):
        pass

    def ProgSave(self, folder, progname, ask_user=False, show_result=False):
        self.addline("END")
        pages = [*self.PROG_LIST, self.PROG]
        for number, self.PROG in enumerate(pages):
            self.progsave(folder, f"{progname}{number or ''}", ask_user, show_result)

    def progsave(self, folder, progname, ask_user=False, show_result=False):
        file = f"{folder}/{progname}.{self.PROG_EXT}"
        with open(file, "w") as stream:
            stream.writelines(f"{line}\n" for line in self.PROG)
        print(f"SAVED: {file}\n")
        self.PROG_FILES.append(file)

    def setFrame(self, pose, frame_id=None, frame_name=None):
        self.addline(f"$BASE = {{FRAME: {self.words(pose)}}}")

    def setTool(self, pose, tool_id=None, tool_name=None):
        self.addline(f"$TOOL = {{FRAME: {self.words(pose)}}}")

    def setSpeed(self, speed_mms):
        self.addline(f"$VEL.CP = {speed_mms / 1000:.5f}")

    def MoveJ(self, pose, joints, conf_RLF=None):
        self.addline("PTP {" + ",".join(f"A{k} {v:.5f}" for k, v in enumerate(joints, 1)) + "}")

    def MoveL(self, pose, joints, conf_RLF=None):
        self.addline(f"LIN {{{self.words(pose)}}} C_DIS")

    def RunMessage(self, message, iscomment=False):
        self.addline(f"; {message}")

    def addline(self, line):
        if len(self.PROG) >= self.MAX_LINES_X_PROG:
            self.PROG_LIST.append(self.PROG)
            self.PROG = []
        self.PROG.append(line)

    @staticmethod
    def words(pose):
        return ",".join(f"{name} {number:.3f}" for name, number in zip("XYZABC", pose, strict=True))


@pytest.fixture
def robodk(tmp_path, monkeypatch):
    """``post(**constants)``: RoboDK generates a program of 40 motions and saves it."""
    base = ModuleType("KUKA_KRC2")
    base.RobotPost = KukaPost
    module = load("robodk", monkeypatch, KUKA_KRC2=base)
    module.COMPENSATE = str(COMMAND)
    (tmp_path / "cell.yaml").write_text(CELL)
    (tmp_path / "part.src").write_text("of the day before")

    def run(ask_user=False, show_result=False, **constants):
        for name, constant in constants.items():
            setattr(module, name, constant)
        post = module.RobotPost("KUKA_compensated", "KR 270", 6, lines_x_prog=10)
        post.ProgStart("part")
        post.setFrame((1500, -200, 600, 0, 0, 0))
        post.setTool((120, 0, 250, 0, 30, 0))
        post.MoveJ(None, [0, -90, 110, 0, 40, 0])
        post.setSpeed(50)
        post.MoveL((0, 0, 50, 0, 0, 180), None)
        post.RunMessage("FORCE -360 50 560 @base", True)
        for k in range(40):
            post.MoveL((5 * k, 0, 0, 0, 0, 180), None)
        post.RunMessage("FORCE OFF", True)
        post.MoveL((195, 0, 50, 0, 0, 180), None)
        post.ProgFinish("part")
        try:
            post.ProgSave(str(tmp_path), "part", ask_user, show_result)
        finally:
            run.files = post.PROG_FILES
        return post

    return SimpleNamespace(run=run, module=module, target=tmp_path / "part.src", folder=tmp_path)


@pytest.mark.slow
def test_robodk_saves_a_compensated_program_on_one_page(robodk, capfd):
    post = robodk.run()
    (sent,) = post.PROG_FILES
    assert sent == str(robodk.target)
    assert capfd.readouterr().out.splitlines().count(f"SAVED: {robodk.target}") == 1
    posted = robodk.folder / "uncompensated" / "part.src"
    assert posted.read_text().count("LIN") == 42
    assert robodk.target.read_text().startswith("DEF part ( )")
    assert sorted(path.name for path in robodk.folder.glob("*.src")) == ["part.src"]
    report = json.loads(posted.with_suffix(".report.json").read_text())
    assert (report["corrected"], report["uncorrected"]) == (40, 0)
    assert report["error_before_mm"]["max"] > 0.5
    assert report["error_after_mm"]["max"] < 0.001


@pytest.mark.parametrize(
    ("constants", "words"),
    [
        ({"COMPENSATE": "/nowhere/compensate"}, "does not start"),
        ({"COMPENSATE": f"{sys.executable} -c 'raise SystemExit(1)'"}, "exit code 1"),
        ({"COMPENSATE": f"{sys.executable} -c 'pass'"}, "exit code 0, there is no program"),
    ],
)
def test_a_failure_leaves_no_program_to_send(robodk, constants, words):
    with pytest.raises(RuntimeError, match=words):
        robodk.run(**constants)
    assert not robodk.target.exists()
    assert robodk.run.files == []


def test_pages_are_refused(robodk):
    post = robodk.module.RobotPost()
    post.PROG_LIST = [["LIN {X 1}"], ["LIN {X 2}"]]
    with pytest.raises(RuntimeError, match="several pages"):
        post.progsave(str(robodk.folder), "part")


def test_a_post_that_writes_elsewhere_is_refused(monkeypatch):
    base = ModuleType("KUKA_KRC2")
    base.RobotPost = type("RobotPost", (), {})
    with pytest.raises(ImportError, match="does not write its file in progsave"):
        load("robodk", monkeypatch, KUKA_KRC2=base)


def test_the_user_chooses_the_file_or_nothing(robodk, monkeypatch):
    chosen = []
    dialog = ModuleType("robodk.robofileio")
    dialog.getSaveFile = lambda folder, name, title: chosen.append(name) or chosen[0].replace("part.src", "")
    monkeypatch.setitem(sys.modules, "robodk", ModuleType("robodk"))
    monkeypatch.setitem(sys.modules, "robodk.robofileio", dialog)
    post = robodk.run(ask_user=True)
    assert chosen == ["part.src"]
    assert post.PROG_FILES == []
    assert robodk.target.read_text() == "of the day before"


@pytest.mark.skipif(os.name == "nt", reason="the program that shows is a shell's")
def test_the_result_is_shown_not_what_was_posted(robodk, monkeypatch):
    shown = []
    monkeypatch.setattr(robodk.module.subprocess, "Popen", lambda words: shown.append(words))

    def stand_in(words, **_):
        Path(words[words.index("-o") + 1]).write_text("done")
        return SimpleNamespace(returncode=3, stdout=b"", stderr=b"")

    monkeypatch.setattr(robodk.module.subprocess, "run", stand_in)
    for show_result in ("editor", ["editor", "-n"], False):
        robodk.run(show_result=show_result)
    target = str(robodk.target)
    assert shown == [["editor", target], ["editor", "-n", target]]
