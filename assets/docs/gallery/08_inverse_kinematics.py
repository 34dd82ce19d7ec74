"""
All branches that reach a pose
==============================

The inverse kinematics gives every branch of a calibrated arm, which has no closed form.
"""

import numpy as np

import workbench as wb

arm = wb.load_robot("ur5")
pose = arm.predict(np.deg2rad([20.0, -80.0, 90.0, -100.0, -80.0, 10.0]))
branches = wb.solve(arm, pose).branches
print(len(branches), "branches")

# %%
# All of them meet the pose to the last digits:

for branch in branches:
    assert np.allclose(arm.predict(branch.q), pose, atol=1e-8)
    print(f"{branch.name:40s}", np.rad2deg(branch.q).round(2))

# %%
# Along a path one branch is followed:

near = pose.copy()
near[:3, 3] += [0.0, 0.0, 0.01]
followed = wb.follow(arm, near, branches[0].q)
print(np.rad2deg(followed.q).round(2))
assert followed.converged
