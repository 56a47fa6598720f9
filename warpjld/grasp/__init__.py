"""Grasping: objects, distances and intersections, flexion search, closing a hand (A §7, R69–R78, R90)."""

from warpjld.grasp.distance import Distances, FacetDistances, ObjectSet, facet_distance
from warpjld.grasp.object_file import load_object
from warpjld.grasp.objects import GraspObject, Places, make_object
from warpjld.grasp.search import NEAREST, FlexionSearch, Found, Searches, Status
from warpjld.grasp.validation import MeshReport

__all__ = [
    "NEAREST",
    "Distances",
    "FacetDistances",
    "FlexionSearch",
    "Found",
    "GraspObject",
    "MeshReport",
    "ObjectSet",
    "Places",
    "Searches",
    "Status",
    "facet_distance",
    "load_object",
    "make_object",
]
