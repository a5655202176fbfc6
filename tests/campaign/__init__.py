"""A campaign as the authors of the paper made it, on a plant that is not the model: MuJoCo's arm with Table 1's values.

A heavy weight hung at a sideways lever at planned configurations, a laser tracker on three reflectors; the parameters
identified from that, and programs compensated with them.  ``python -m tests.campaign`` prints it all.
"""
