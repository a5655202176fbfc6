"""The blind benchmark of the diagnosis: an effect is hidden in an arm that MuJoCo bends, and what the diagnosis says of
its readings is held against the truth.

The plant is other physics than the model, with other parameters: stiffness, masses and geometry are off, readings have
heavy tails, every pose is repeated as well as a robot does.  The process that diagnoses is given a folder with
``data.csv`` and ``robot.yaml``, and may open nothing else of a run; the truth lies in another tree.

    python -m tests.blind [--runs N] [--rows single,outside] [--seed S] [--workers 2] [--out FILE]

    arm           what really stands there, and the robot file that is wrong about it
    hidden        the effects of the library as hardware of the plant
    outside       effects that the library does not have
    design        what is measured: poses, loads, reflectors, order
    measured      readings by the plant
    cases         the matrix: which run hides what
    oracle        who knows the truth: how large it shows, whether anything else could be it
    worker        the process that diagnoses
    verdicts      right or wrong
    table         counts, intervals, confusion, picture
"""
