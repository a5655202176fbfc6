"""Each command as a function on paths: the rooms below, put in their order."""

from postproc.workflows import codes as codes
