"""Surfaces in a browser's page, by viser: its server with a guard, the stage's lights, and pages that play by
themselves."""
