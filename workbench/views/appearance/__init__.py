"""Appearance shared by all views: solids of arms and targets, and one meaning per colour."""
