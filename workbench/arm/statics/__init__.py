"""Forces and moments through the joints, and how effects bend the arm under them."""
