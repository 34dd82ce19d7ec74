"""
Your own measurements
=====================

One row per pose, a unit in every heading. The reader reports how it interpreted the file.
"""

from pathlib import Path

import workbench as wb

Path("measured.csv").write_text(
    "q1[deg];q2[deg];q3[deg];q4[deg];q5[deg];q6[deg];x[mm];y[mm];z[mm];operator\n"
    "0,0;-90,0;90,0;-90,0;-90,0;0,0;491,92;-109,02;487,29;A\n"
    "10,0;-80,0;80,0;-90,0;-90,0;0,0;504,13;-22,10;521,87;A\n"
    "20,0;-70,0;95,0;-95,0;-80,0;5,0;452,60;58,04;430,11;B\n"
)
data = wb.read_measurements("measured.csv")
data

# %%
# Decimal commas were recognised, degrees and millimetres became SI, and a column that does not concern the arm
# was left out:

print(data.q[1].round(3), data.position[1])
print(*data.notes, sep="\n")
assert data.position.shape == (3, 3)
