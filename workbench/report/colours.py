"""One colour for each model of an arm, on the page, in recordings and in reports (Okabe & Ito's palette)."""

NOMINAL = "#8c939c"
GEOMETRY = "#0072b2"
"""The calibrated geometry alone."""
CALIBRATED = "#d55e00"
"""The geometry with effects; the real arm in a scene, and the result in a report."""
UNNAMED = "#cc79a7"
"""What has no name, or none yet."""
EVENT = "#0ea5e9"
"""What happened while rows were measured."""
GOOD, BAD, CAREFUL = (
    "light-dark(#15803d, #4ade80)",
    "light-dark(#b91c1c, #f98080)",
    "light-dark(#9a5800, #fbbf24)",
)
"""Colours of words that read on light and on dark pages."""
