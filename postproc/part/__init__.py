"""The surface that a program leaves on the part, and its error before and after the correction."""

from postproc.part import codes as codes
