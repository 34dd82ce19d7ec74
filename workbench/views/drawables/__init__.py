"""What the page and recordings draw of a session: one file per subject, shared by all sinks.

| path | what |
|---|---|
| `arm/nominal`, `arm/calibrated` | the model, and the real arm bent away from it by its exaggerated error |
| `arm/branch/N` | other branches that reach the target |
| `arm/blame/N` | a glow about the joints of the strongest cause |
| `plate/solid`, `plate/targets/N`, `…/number` | the fixture and its targets |
| `region/outline`, `region/cubes` | the region of interest and its cube field |
| `measured`, `measured/held_out` | measured positions, coloured by their error |
| `measured/set_apart` | rows that no arm explains |
| `errors/nominal`, `errors/calibrated` | errors of the nominal and the shown model as arrows, exaggerated |
| `errors/sample` | an arrow that shows how long an error is drawn |
| `row/mark` | the selected measured position |
"""
