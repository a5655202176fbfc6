"""A slow interpreter of RAPID and random programs for it: what the reader claims is held against what they do."""
