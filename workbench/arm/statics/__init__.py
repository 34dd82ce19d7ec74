"""Forces and moments through the joints, and the resulting deflection of the arm."""
