"""Post-processor files for CAM systems: each runs in the Python of its system and calls the command ``compensate``."""

from __future__ import annotations

from pathlib import Path

POSTS = {"freecad": "compensate_post.py", "robodk": "kuka_compensated.py"}
"""System -> its file, in the folder of the system's name; under this name the system looks for it.  The folders are no
packages: their files cannot be imported but in their system."""


def post_file(system: str) -> Path:
    """The post-processor file of one of ``POSTS``."""
    return Path(__file__).with_name(system) / POSTS[system]
