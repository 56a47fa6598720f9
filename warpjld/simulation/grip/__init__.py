"""Grips searched for: squeezes to a force or until a weight is held, and angles corrected to what muscles can do."""
