"""The study of the tests on a cluster: eight units."""

STUDY = """schema = 2
name = "on a cluster"
seed = 271828
[packing]
radii = "uniform:0.03:0.06"
box = [1.0, 1.0]
density = [0.55, 0.60]
[contacts]
rule = "bonded"
contact_angle = [5.0, 10.0]
[statistics]
realizations = 4
"""
