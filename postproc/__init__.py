"""Offline post-processor that makes an industrial robot cut as if it were rigid.

``import postproc`` is light: what computes is loaded when it is first named.

>>> import postproc
>>> postproc.check("samples/kr270_taught/taught.src").kinds
{'PTP': 4, 'LIN': 22}
"""

__version__ = "0.3.0"

__all__ = [
    "Batched",
    "Checked",
    "Diagnosed",
    "Engaged",
    "Finding",
    "Identified",
    "Learned",
    "Mapped",
    "PartAssignment",
    "Placement",
    "Planned",
    "Refusal",
    "Report",
    "Verified",
    "__version__",
    "assign",
    "batch",
    "check",
    "compensate",
    "diagnose",
    "engage",
    "identify",
    "learn",
    "map",
    "place",
    "plan",
    "predict",
    "verify",
]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module 'postproc' has no attribute {name!r}")
    import importlib

    value = getattr(importlib.import_module("postproc.api"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
