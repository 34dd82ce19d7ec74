"""
How well a plate determines an arm
==================================

The ten-target plate of the ARIA paper: the observability of each target and of the whole set, and the error
to expect over the region after a calibration with it.
"""

import workbench as wb

arm = wb.load_robot("aria")
plate = wb.load_plate("table2")
score = wb.score(arm, plate)
score

# %%
# The same ten targets measured in one posture each would be worth far less than in the branches that are named:

for label, found in (("mixed branches", score.measured), ("a single branch", score.single)):
    print(f"{label}: {1e3 * found.error.position_rms:.3f} mm over the region")
assert score.measured.error.position_rms < score.single.error.position_rms
