"""What readings of one pose share beyond the stated scatter is reported: an effect that is missing looks like that."""

from __future__ import annotations

import numpy as np
import pytest
from warm_arm import REFERENCE, SIGMA, robot, written

from postproc.report.identified_terminal import verdict
from postproc.workflows.identify import IdentifyRequest, identify


@pytest.mark.parametrize("shift", [0.0, 3e-5, 1e-4])
def test_what_poses_share_is_no_scatter(tmp_path, shift):
    data = written(tmp_path / "poses.csv", 20.0, 5, shift=shift)
    asked = IdentifyRequest((data,), robot(tmp_path, REFERENCE), effects=("thermal_growth.g2",), bootstrap=0)
    result = identify(asked)
    found = {finding.code: finding for finding in result.findings}
    if not shift:
        assert result.exit == 0
        assert not {"IDN029", "IDN039"} & found.keys()
        assert verdict(result).endswith("they show nothing more.")
        return
    assert result.exit == 3
    assert "IDN029" not in found
    times = float(found["IDN039"].message.split("residuals are ")[1].split(" times")[0])
    # each coordinate scatters by both together
    assert times == pytest.approx(np.hypot(shift, SIGMA) / SIGMA, rel=0.25)
    assert "show nothing more" not in verdict(result)
    assert "those of one pose share another" in verdict(result)
