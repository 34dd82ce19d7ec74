"""Where the tool and the links are, and how the constants move them."""
