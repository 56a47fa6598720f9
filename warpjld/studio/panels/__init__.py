"""Panels of the studio: views that show and edit the state; each refreshes itself from it."""
