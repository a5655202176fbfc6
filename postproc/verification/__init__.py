"""A second opinion on a compensated program: read again, its tool simulated along its path under the original's forces.

It shares nothing with the compensation but the model of the robot: force and place are found together (``placing``),
cuts are matched by their order (``cuts``), paths are taken as the controller runs them (``run_path``).
"""
