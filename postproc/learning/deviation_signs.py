"""What a positive deviation can mean."""

from __future__ import annotations

SIGNS = ("material_left", "material_missing")
"""Of a positive DEV along the outward normal."""
