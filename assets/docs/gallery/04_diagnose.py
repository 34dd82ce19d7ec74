"""
Find what the model lacks
=========================

A joint that yields to its load is hidden in a virtual arm. Its geometry alone can't explain the rows; the
diagnosis names the joint, adds the effect, and says what that explains on rows that took no part.
"""

import workbench as wb

arm = wb.load_robot("aria")
_, data = wb.measure_poses(arm, 80, effects=["joint-compliance:2"], seed=1)
found = wb.diagnose(arm, data)
print(found.message)

# %%

found.plot()

# %%

assert "joint-compliance" in {effect.name for effect in found.robot.effects}
found
