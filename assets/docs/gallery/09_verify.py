"""
Verify a calibrated arm
=======================

Fresh poses, an interval instead of a bare mean, and pass or fail against a required error.
"""

import workbench as wb

arm = wb.load_robot("aria")
actual, data = wb.measure_poses(arm, 80, seed=1)
calibrated = wb.identify(arm, data).robot
_, fresh = wb.measure_poses(arm, 30, actual=actual, seed=2)
wb.verify(calibrated, fresh, wanted=3e-4)
