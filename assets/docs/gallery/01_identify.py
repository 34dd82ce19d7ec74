"""
Identify an arm's geometry
==========================

A virtual ARIA with hidden manufacturing errors is measured at 60 poses; its geometry is identified.
The error that counts is the one on held-out rows.
"""

import workbench as wb

arm = wb.load_robot("aria")
actual, data = wb.measure_poses(arm, 60, instrument="tracker-6d", seed=1)  # actual: for comparison only
fit = wb.identify(arm, data, held_out=0.2)
fit

# %%
# The true geometry is known here. At poses far from the measured ones the calibrated arm is off by

import numpy as np

rng = np.random.default_rng(2)
q = rng.uniform(*arm.search_limits.T, size=(200, arm.dof))
off = np.linalg.norm((fit.robot.predict(q) - actual.predict(q))[:, :3, 3], axis=1)
nominal = np.linalg.norm((arm.predict(q) - actual.predict(q))[:, :3, 3], axis=1)
print(f"nominal {1e3 * nominal.mean():.2f} mm, calibrated {1e3 * off.mean():.3f} mm on average")
assert off.mean() < 0.05 * nominal.mean()
