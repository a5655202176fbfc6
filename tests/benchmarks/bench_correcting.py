"""What correcting a motion costs: its own correction, and what is between its points."""


def test_correct(work, measured):
    result = measured(work["correct"].again)
    assert result.corrected.sum() >= work.motions


def test_divide(work, measured):
    division = measured(work["divide"].again)
    assert len(division) >= work.motions
