"""Grasping: objects, distances and intersections, flexion search, closing a hand (A §7, R69–R78, R90)."""

from warpjld.grasp.distance import Distances, ObjectSet
from warpjld.grasp.facet import FacetDistances, facet_distance
from warpjld.grasp.object_file import load_object
from warpjld.grasp.objects import GraspObject, Places, make_object
from warpjld.grasp.search import FlexionSearch
from warpjld.grasp.search_result import SearchResult, SearchStatus
from warpjld.grasp.searches import NEAREST, Searches
from warpjld.grasp.validation import MeshReport

__all__ = [
    "NEAREST",
    "Distances",
    "FacetDistances",
    "FlexionSearch",
    "GraspObject",
    "MeshReport",
    "ObjectSet",
    "Places",
    "SearchResult",
    "SearchStatus",
    "Searches",
    "facet_distance",
    "load_object",
    "make_object",
]
