"""Where model and measurement disagree, and the name of what is missing."""

from postproc.diagnosis import codes as codes
