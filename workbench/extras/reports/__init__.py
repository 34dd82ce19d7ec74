"""Pages of results for people: an identification and a diagnosis as HTML, with all their figures."""
