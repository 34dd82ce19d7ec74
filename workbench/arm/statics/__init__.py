"""Forces and moments through the joints, and the deflection of the arm under them."""
