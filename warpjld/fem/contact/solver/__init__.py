"""The contact solver: Newton's method on bodies and contact together, load steps."""
