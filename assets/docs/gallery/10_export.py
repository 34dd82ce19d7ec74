"""
Export the calibrated arm
=========================

A calibrated arm is a TOML or a URDF file; the URDF gives the same poses in any other program.
"""

import numpy as np

import workbench as wb

arm = wb.load_robot("panda")
_, data = wb.measure_poses(arm, 60, seed=1)
fit = wb.identify(arm, data)
saved = [fit.robot.save(name) for name in ("calibrated.toml", "calibrated.urdf")]

# %%
# Read back, at a hundred poses:

again = wb.load_robot("calibrated.urdf")
q = np.random.default_rng(0).uniform(*arm.search_limits.T, size=(100, arm.dof))
off = np.abs(again.predict(q) - fit.robot.predict(q)).max()
print(f"largest difference {off:.1e}")
assert off < 1e-9
