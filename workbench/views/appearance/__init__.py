"""How things look, for every view alike: solids of arms and targets, and one meaning for each colour."""
