"""Many programs: checked before the first starts, done beside each other, resumable, summed up."""

from postproc.batching import codes as codes
