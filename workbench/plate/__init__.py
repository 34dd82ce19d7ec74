"""Fixture plates: targets, region, indices, score, poses, optimiser, production, parts."""
