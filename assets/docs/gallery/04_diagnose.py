"""
Find what the model lacks
=========================

A virtual arm has a compliant joint, which geometry alone can't explain. The diagnosis names the joint, adds the
effect, and reports what it explains on held-out rows.
"""

import workbench as wb

arm = wb.load_robot("aria")
_, data = wb.measure_poses(arm, 80, effects=["joint-compliance:2"], seed=1)
found = wb.diagnose(arm, data)
found

# %%

assert "joint-compliance" in {effect.name for effect in found.robot.effects}
found
