"""Covering: binding a surface to a skeleton and deforming it (R16–R68)."""

from warpjld.covering.bind import bind, bind_rig
from warpjld.covering.covering import Covering
from warpjld.covering.parameters import Parameters, default_parameters, load_parameters, save_parameters

__all__ = ["Covering", "Parameters", "bind", "bind_rig", "default_parameters", "load_parameters", "save_parameters"]
