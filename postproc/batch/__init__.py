"""Many programs: checked before the first starts, done beside each other, resumable, summed up."""

from postproc.batch import codes as codes
