"""Many programs: checked before the first begins, done beside each other, resumable, summed up."""
