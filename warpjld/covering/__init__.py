"""Covering: binding a surface to a skeleton and deforming it (R16–R68)."""

from warpjld.covering.covering import Covering
from warpjld.covering.parameters import Parameters, default_parameters, load_parameters, save_parameters
from warpjld.covering.surface_binding import bind, bind_rig

__all__ = ["Covering", "Parameters", "bind", "bind_rig", "default_parameters", "load_parameters", "save_parameters"]
