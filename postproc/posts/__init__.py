"""Post-processor files for CAM systems: each runs in the Python of its system and calls the command ``compensate``."""

from __future__ import annotations

from pathlib import Path

POSTS = {"freecad": "compensate_post.py", "robodk": "kuka_compensated.py"}
"""System -> its file in this folder; the name under which the system looks for it."""


def post_file(system: str) -> Path:
    """The post-processor file of one of ``POSTS``."""
    return Path(__file__).with_name(POSTS[system])
