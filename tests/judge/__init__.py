"""An independent judge of written programs: its own reader, kinematics, equilibrium and force rule.

Nothing of ``postproc`` is imported here, not even its units: what the tool writes is read as bytes, run along the whole
path on an arm built in MuJoCo, and compared with the path that the original program asks for.

    reader   the bytes of a KRL or G-code program -> motions
    robot    the arm of a robot file: MuJoCo model, inverse kinematics, static equilibrium
    path     the motions as a controller interpolates and approximates them
    force    the wrench at each place of the original's path
    judge    an original and its output -> errors along every cut, stops, motions backwards
    cases    programs of the classes that matter; ``python -m tests.judge`` runs them all and prints a table
"""
