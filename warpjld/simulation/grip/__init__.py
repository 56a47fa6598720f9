"""Grip searches (smallest grip that holds a weight, grip of a given force) and corrections to the muscles' limits."""
