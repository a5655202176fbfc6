"""A second opinion on a compensated program: read again, its tool simulated along its path under the original's forces.

It shares nothing with the compensation but the model of the robot: force and place are solved together
(``tool_placement``), cuts are matched by their order (``pairing``), paths are taken as the controller runs them
(``run_path``).  What the programs state beside the places of their motions is compared as text, by forms of the
languages of its own (``statement_comparison``).
"""
