"""Statements of the manuals, put into programs one at a time: what acts must show, what does not must cost nothing."""
