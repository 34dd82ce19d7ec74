"""
Your own robot, from its data sheet
===================================

A table of joints is all that is needed. Type a pose from the controller's display to check the convention.
"""

import numpy as np

import workbench as wb

# theta [rad], d [m], a [m], alpha [rad] of a UR5 in standard DH
table = [
    (0.0, 0.089159, 0.0, np.pi / 2),
    (0.0, 0.0, -0.425, 0.0),
    (0.0, 0.0, -0.39225, 0.0),
    (0.0, 0.10915, 0.0, np.pi / 2),
    (0.0, 0.09465, 0.0, -np.pi / 2),
    (0.0, 0.0823, 0.0, 0.0),
]
arm = wb.Robot.from_dh(table, name="my arm")
arm

# %%
# The tool's position at a pose [m], to be compared with the display:

q = np.deg2rad([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
print(arm.predict(q)[:3, 3].round(4))

# %%
# Where the same arm is built in, both agree:

arm.save("my_arm.toml")
assert np.allclose(arm.predict(q), wb.load_robot("ur5").predict(q), atol=1e-6)
