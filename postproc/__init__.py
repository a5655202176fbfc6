"""Offline post-processor that makes an industrial robot cut as if it did not bend."""

__version__ = "0.1.0"
