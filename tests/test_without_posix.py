"""The same results, byte for byte, where there is neither Pinocchio nor what only POSIX systems have, as on Windows."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

BLOCK = """
import sys
BLOCKED = {"fcntl", "resource", "termios", "tty", "pty", "pwd", "grp", "pinocchio", "pinocchio_pywrap_default"}
class Block:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in BLOCKED:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Block())
for name in BLOCKED:
    sys.modules.pop(name, None)
"""

COMMANDS = {
    "program": ["kr270_panel/panel.src", "--force", "-o", "out/"],
    "batch": ["batch", "night.yaml", "-o", "out", "-j", "2"],
    "identify": [
        *("identify", "kr270_campaign/loads.csv", "--robot", "kuka_kr270", "--effects", "joint_compliance"),
        *(
            "-o",
            "out/new.yaml",
            "--page",
            "out/page.html",
            "--csv",
            "out/rows.csv",
            "--json",
            "out/result.json",
        ),
    ],
    "diagnose": [
        *(
            "diagnose",
            "kr270_missing_compensator/loads.csv",
            "--robot",
            "kr270_missing_compensator/kr270_plain.yaml",
        ),
        *(
            "-o",
            "out/new.yaml",
            "--page",
            "out/page.html",
            "--csv",
            "out/rows.csv",
            "--json",
            "out/result.json",
        ),
    ],
}


def run(folder: Path, words: list[str], blocked: Path | None) -> tuple[int, str, dict[str, bytes]]:
    """Exit code, words, and the files below ``out`` but for the records of a batch, which state times."""
    shutil.copytree(ROOT / "samples", folder / "work")
    paths = [*([] if blocked is None else [str(blocked)]), str(ROOT), os.environ.get("PYTHONPATH", "")]
    done = subprocess.run(
        [sys.executable, "-m", "postproc", *words],
        cwd=folder / "work",
        # filelock warns that it has locks by existence only: on Windows it has others
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONWARNINGS": "ignore"},
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    out = folder / "work" / "out"
    files = {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in out.rglob("*")
        if path.is_file() and ".compensate" not in path.parts
    }
    shutil.rmtree(folder / "work")
    return done.returncode, done.stdout + done.stderr, files


@pytest.mark.slow
@pytest.mark.parametrize("name", ["program", "identify", "diagnose", "batch"])
def test_the_same_bytes_without_posix_and_without_pinocchio(tmp_path, name):
    hook = tmp_path / "hook"
    hook.mkdir()
    (hook / "sitecustomize.py").write_text(BLOCK)
    known = subprocess.run(
        [sys.executable, "-c", "import pinocchio"],
        env={**os.environ, "PYTHONPATH": str(hook)},
        capture_output=True,
        check=False,
    )
    assert b"No module named 'pinocchio'" in known.stderr
    code, said, files = run(tmp_path, COMMANDS[name], hook)
    assert code in (0, 3), said
    assert "Traceback" not in said
    wanted_code, wanted_said, wanted = run(tmp_path, COMMANDS[name], None)
    assert code == wanted_code
    assert files.keys() == wanted.keys()
    assert len(files) >= 4
    differing = [path for path in files if files[path] != wanted[path]]
    assert differing == []
    if name != "batch":  # which prints how long it took
        assert said == wanted_said


@pytest.mark.slow
def test_no_module_of_the_package_needs_posix_to_be_imported():
    script = BLOCK + (
        "import importlib, importlib.util, pkgutil, postproc\n"
        "names = [one.name for one in pkgutil.walk_packages(postproc.__path__, 'postproc.')]\n"
        "names = [name for name in names if not name.endswith('__main__')]\n"
        "if importlib.util.find_spec('numba') is None:\n"  # an extra
        "    names = [name for name in names if not name.startswith('postproc.process.stock.')]\n"
        "[importlib.import_module(name) for name in names]\n"
        "print(len(names))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 300


def test_a_chain_is_pinocchios_where_there_is_pinocchio():
    """With every extra coordinate that the effects ask for: position, and columns at the flange."""
    import numpy as np
    import pinocchio as pin

    from postproc.base.geometry import Poses
    from postproc.robot.chain import Chain
    from postproc.robot.description import find_robot, load_robot

    for name in ("kuka_kr270", "ur5", "staubli_tx2_90l"):
        robot = load_robot(find_robot(name))
        extras = ["base.rx", "A2.growth", f"{robot.joints[2].name}.ry"]
        chain = Chain(
            robot.joints,
            Poses.identity(),
            [extra for extra in extras if extra != "A2.growth" or robot.joints[1].name == "A2"],
        )
        model = chain.model
        assert list(model.names)[1:] == list(chain.names)
        data = model.createData()
        q = np.random.default_rng(1).uniform(-2.0, 2.0, (50, chain.size))
        ours = chain.evaluate(q.T.copy(), Poses.identity())
        for row, state in enumerate(q):
            pin.framesForwardKinematics(model, data, state)
            place = data.oMf[chain.model.getFrameId("flange")]
            np.testing.assert_allclose(ours.position[:, row], place.translation, atol=1e-12)
            for column in range(3):
                np.testing.assert_allclose(ours.tcp[column][:, row], place.rotation[:, column], atol=1e-12)
