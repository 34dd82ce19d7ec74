"""What page and recordings draw of a session, said once: a subject a file, for every sink alike.

| path | what |
|---|---|
| `arm/nominal`, `arm/calibrated` | the arms |
| `arm/bent`, `arm/branch/N` | as its effects bend it; in the other branches that reach the selected target |
| `arm/blame/N` | a glow about the joint of the effect whose law is shown |
| `plate/solid`, `plate/targets/N`, `…/number` | fixture, targets |
| `plate/before/N`, `reach/envelope` | targets before the last step; how far the arm reaches, in a drag |
| `region/outline`, `region/cubes` | the region that matters and its cube field |
| `measured`, `measured/held_out` | measured positions, coloured by their error |
| `errors/nominal`, `errors/calibrated` | errors as arrows, exaggerated |
| `row/frames`, `row/mark` | measured orientations, the measured position that is looked at |
| `track/wanted`, `track/reached` | the planned trajectory, and where the tool goes |
| `camera/NAME`, `camera/target` | what a camera can see, and the target before it |
| `camera/ellipsoid` | where the tool may be, enlarged |
| `track/arm`, `track/mark`, `track/trail/N` | the arm that errs on its way, and what it left behind |
"""
