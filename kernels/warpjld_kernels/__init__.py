"""Warp device code of warpjld: kernels and functions only, nothing from the host side."""
