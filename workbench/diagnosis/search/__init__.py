"""What the model lacks: candidates, their evidence, events, and rounds of search and fit."""
