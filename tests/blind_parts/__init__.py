"""The blind benchmark of learning from a measured part: MuJoCo cuts a part, the learner gets a probe's deviations.

The plant is other physics than the model: springs, a spatial tendon and weights of MuJoCo, with compliances, forces,
tool and hidden hardware drawn for each part.  The process that learns is given a folder with a program, a cell and the
CSV of the part, and writes the next program, which the plant cuts; the truth stays in the memory of this process.

    python -m tests.blind_parts [--rows same50,...] [--draws N] [--seed S] [--minutes M] [--append FILE]

    shop      the part: program, cell, points of its surface
    truth     what the robot and the process of a draw really are
    cutting   a part cut by the plant: errors at the points, deviations of the probe
    mirrors   what others do: the deviation itself, interpolated, turned round
    worker    the process that learns
    rows      the rows of the table, and one draw of each
    table     figures with 95 % intervals
    visible   how much a hidden effect shows in the deviations
    bounds    the most that could be removed
    bad_files files with a mistake, of which none may be learnt from
"""
