"""Where a part lies in the workspace, and how stiff the robot is there."""

from postproc.placement import codes as codes
