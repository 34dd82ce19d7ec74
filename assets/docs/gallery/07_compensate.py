"""
Apply the result: correct a trajectory
======================================

A controller that knows only the nominal arm is given joints with which the real arm reaches the intended poses.
"""

import matplotlib.pyplot as plt
import numpy as np

import workbench as wb

arm = wb.load_robot("aria")
actual, data = wb.measure_poses(arm, 80, seed=1)
calibrated = wb.identify(arm, data).robot

time = np.linspace(0.0, 4.0, 41)
turn = np.sin(np.pi * time / 4.0)[:, None]
start, swing = [0.0, 40.0, -80.0, 30.0, 60.0, 0.0], [40.0, 10.0, -15.0, 15.0, 20.0, 60.0]
q = np.deg2rad(start) + turn * np.deg2rad(swing)
columns = ",".join(["time[s]", *(f"q{joint}[rad]" for joint in range(1, 7))])
np.savetxt("path.csv", np.column_stack([time, q]), delimiter=",", header=columns, comments="")
corrected = wb.compensate(calibrated, wb.read_trajectory("path.csv"), nominal=arm)

# %%
# What the actual arm does with either:

meant = arm.predict(q)[:, :3, 3]
for label, joints in (("as planned", q), ("corrected", corrected.q)):
    off = 1e3 * np.linalg.norm(actual.predict(joints)[:, :3, 3] - meant, axis=1)
    plt.semilogy(time, off, label=f"{label}: {off.mean():.3f} mm on average")
plt.xlabel("time [s]")
plt.ylabel("position error [mm]")
plt.legend()
plt.show()
assert off.mean() < 0.1
