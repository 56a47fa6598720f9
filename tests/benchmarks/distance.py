"""How fast distances and searches are, beside Open3D and queries of ``wp.Mesh``, in one run.

    python tests/benchmarks/distance.py [--points 10000] [--repeats 15]

Open3D (pip install open3d) is left out where it is not installed. Queries of ``wp.Mesh`` run on one thread, and give
float32 distances whose sign is by winding number, or by the nearest feature's normal. Rows are measured in turn, so
that a machine that slows down slows all of them; compare ratios. Half of the points lie within 5 mm of the surface.
"""

from __future__ import annotations

import importlib
import time
from collections import defaultdict
from collections.abc import Callable

import click
import numpy as np
import warp as wp
from rich.console import Console
from rich.table import Table

from warpjld.covering import bind
from warpjld.grasp import NEAREST, FlexionSearch, GraspObject, ObjectSet, Searches, SearchStatus
from warpjld.grasp.close import Closer
from warpjld.grasp.judge import Judge
from warpjld.grasp.shapes import ball, cylinder
from warpjld.hand import build_hand
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles

FLEXION = CHANNELS.index("flexion")


@click.command()
@click.option("--points", default=10_000, show_default=True)
@click.option("--repeats", default=15, show_default=True)
def main(points: int, repeats: int) -> None:
    """Print throughputs and their ratios as tables."""
    console = Console()
    bumpy = bumpy_ball(10_000)
    console.print(distances(bumpy, points, repeats))
    console.print(deforming_hand(bumpy, repeats))
    console.print(searches(repeats))
    console.print(grasps())


def bumpy_ball(triangles: int) -> GraspObject:
    """An object without symmetries, 10 cm across."""
    from warpjld.grasp.objects import make_object

    smooth = cylinder(0.09, 0.09, segments=triangles // 88)
    v = smooth.vertices
    bumps = 1 + 0.12 * np.sin(90 * v[:, :1]) * np.cos(70 * v[:, 1:2]) + 0.08 * np.sin(110 * v[:, 2:])
    return make_object("bumpy", v * bumps, smooth.faces)


def cloud(thing: GraspObject, count: int) -> np.ndarray:
    """Points, half of them within 5 mm of the surface."""
    rng = np.random.default_rng(0)
    face = rng.integers(len(thing.faces), size=count)
    on = np.einsum("nk,nki->ni", rng.dirichlet([1, 1, 1], size=count), thing.vertices[thing.faces[face]])
    near = on + thing.normals[face] * rng.uniform(-0.005, 0.005, size=(count, 1))
    far = rng.uniform(-0.1, 0.1, size=(count, 3))
    return np.where(np.arange(count)[:, None] % 2, near, far).astype(np.float32)


def distances(thing: GraspObject, count: int, repeats: int) -> Table:
    """Signed distances of a cloud of points, 1 and 2 threads."""
    points, ours = cloud(thing, count), ObjectSet(thing)
    methods: dict[str, Callable[[], object]] = {}
    for threads in (1, 2):
        methods[f"warpjld, all distances, {threads}"] = lambda t=threads: ours.distances(points, threads=t)
        methods[f"warpjld, those within 5 mm, {threads}"] = lambda t=threads: ours.distances(
            points, limit=0.005, threads=t
        )
        if scene := open3d_scene(thing):
            methods[f"Open3D, all distances, {threads}"] = lambda t=threads: scene.signed(points, t)
    methods |= {f"{name}, 1": (lambda q=query: q.signed(points)) for name, query in mesh_queries(thing).items()}
    times = in_turn(methods, repeats)
    title = f"signed distance to {len(thing.faces):,} triangles, thousand points per second (median)"
    return beside_open3d(title, times, count / 1e3)


def deforming_hand(thing: GraspObject, repeats: int) -> Table:
    """Every vertex of a hand that closes round an object, deformation included, frames per second.

    The rows of all distances, ours and Open3D's, give every vertex its signed distance. The row within 5 mm gives the
    same distances to the vertices nearer than that, and +inf to the others: what contact asks for. Open3D has no limit.
    """
    rig = build_hand("left", resolution=4600)
    covering = bind(rig.skeleton, rig.surface)
    frames, placed = 24, thing.placed((0.0, -0.07, -0.07))
    poses = fist(rig.skeleton, frames)
    ours = ObjectSet(placed)
    skin = np.empty((frames, len(rig.surface.vertices), 3), dtype=np.float32)

    def mine(threads: int, limit: float) -> None:
        surfaces = covering.deform(poses, out=skin, threads=threads)
        ours.distances(surfaces, sets=np.arange(frames), which=np.zeros(frames, int), limit=limit, threads=threads)

    def theirs(scene: Open3DScene, threads: int) -> None:
        surfaces = covering.deform(poses, out=skin, threads=threads)
        for surface in surfaces:
            scene.signed(surface - placed.place.position[0].astype(np.float32), threads)

    methods: dict[str, Callable[[], object]] = {}
    for threads in (1, 2):
        methods[f"warpjld, all distances, {threads}"] = lambda t=threads: mine(t, np.inf)
        methods[f"warpjld, those within 5 mm, {threads}"] = lambda t=threads: mine(t, 0.005)
        if scene := open3d_scene(thing):
            methods[f"Open3D, all distances, {threads}"] = lambda t=threads, s=scene: theirs(s, t)

    def queried(query: MeshQuery) -> None:
        surfaces = covering.deform(poses, out=skin, threads=1)
        query.signed((surfaces - placed.place.position[0].astype(np.float32)).reshape(-1, 3))

    methods |= {f"{name}, 1": (lambda q=query: queried(q)) for name, query in mesh_queries(thing).items()}
    times = in_turn(methods, max(3, repeats // 3))
    count = len(rig.surface.vertices)
    title = (
        f"hand of {count:,} vertices against {len(thing.faces):,} triangles, deformed and measured, frames per second"
    )
    return beside_open3d(title, times, frames)


def beside_open3d(title: str, times: dict[str, list[float]], done: float) -> Table:
    """What is done a second by each method on 1 and 2 threads, and the ratios of ours to Open3D."""
    peer, ours = "Open3D, all distances", ("warpjld, all distances", "warpjld, those within 5 mm")
    table = Table(title=title)
    for heading in ("", "1 thread", "2 threads"):
        table.add_column(heading, justify="left" if not heading else "right")
    for name in (*ours, peer):
        if f"{name}, 1" in times:
            table.add_row(name, *(f"{done / np.median(times[f'{name}, {t}']):.0f}" for t in (1, 2)))
    for name in QUERIES:
        table.add_row(name, f"{done / np.median(times[f'{name}, 1']):.0f}", "")
    for name in ours:
        if f"{peer}, 1" in times:
            ratios = [np.median(np.divide(times[f"{peer}, {t}"], times[f"{name}, {t}"])) for t in (1, 2)]
            table.add_row(f"{name} / Open3D", *(f"{r:.2f} ×" for r in ratios))
    return table


def searches(repeats: int) -> Table:
    """Flexion searches that end in a contact, one thread."""
    rig = build_hand("left", resolution=4600)
    covering, rng, count = bind(rig.skeleton, rig.surface), np.random.default_rng(0), 10_000
    joints = [rig.skeleton.index(f"{d}.base") for d in ("index", "middle", "ring", "pinky")]
    thing = ball(0.09).placed((0.0, -0.075, -0.11))
    poses, angles = open_hands(rig.skeleton, 1)
    search = FlexionSearch(covering, ObjectSet(thing))
    tips = np.concatenate([np.flatnonzero(covering.surface.vertices[:, 2] < -0.12)])
    vertex, joint = rng.choice(tips, count), rng.choice(joints, count)
    below = np.flatnonzero(thing.normals[:, 1] > 0.7)
    table = Table(title="flexion searches, one thread, thousand per second (median)")
    for heading in ("", "per second", "mappings each", "in contact"):
        table.add_column(heading, justify="left" if not heading else "right")
    for name, facet in (("facet", rng.choice(below, count)), ("mesh of 5,120 triangles", NEAREST)):
        wanted = Searches(vertex=vertex, joint=joint, facet=facet)
        found = search.run(poses, angles, wanted, threads=1)
        taken = in_turn({name: lambda w=wanted: search.run(poses, angles, w, threads=1)}, repeats)[name]
        share = np.mean(found.status == SearchStatus.CONVERGED)
        table.add_row(name, f"{count / np.median(taken):,.0f}", f"{found.evaluations.mean():.1f}", f"{share:.0%}")
    return table


def grasps() -> Table:
    """Whole hands closed on a ball: at a first look, in full, and scored."""
    rig = build_hand("left", resolution=1500)
    covering = bind(rig.skeleton, rig.surface)
    count = 32
    closer = Closer(covering, ball(0.065))
    judge = Judge(closer.both, "left", 0.6)
    rng = np.random.default_rng(0)
    shift = -np.array([0.004, -0.056, -0.062]) + rng.uniform(-0.004, 0.004, size=(count, 3)) * [1, 0, 1]
    _, angles = open_hands(rig.skeleton, count)
    poses = poses_from_angles(rig.skeleton, angles, root_position=shift)
    held = []

    def scored() -> None:
        closed = closer.close(poses, angles)
        ended = poses_from_angles(rig.skeleton, closed.angles, root_position=shift)
        held[:] = judge.judge(ended, covering.deform(ended, threads=1), closed.penetration)

    methods: dict[str, Callable[[], object]] = {
        "first look: a third of the vertices search": lambda: closer.close(poses, angles, quick=True),
        "closed, edges kept out of the skin": lambda: closer.close(poses, angles, apart=False),
        "complete: digits apart too, contacts, force closure, epsilon": scored,
    }
    times = in_turn(methods, 3)
    table = Table(title=f"hands of {len(covering.surface.vertices):,} vertices closed on a ball, one thread")
    for heading in ("", "grasps per second", "force closed"):
        table.add_column(heading, justify="left" if not heading else "right")
    for name in methods:
        share = f"{np.mean([one.closed for one in held]):.0%}" if name.startswith("complete") else ""
        table.add_row(name, f"{count / np.median(times[name]):.1f}", share)
    return table


def fist(skeleton, frames: int) -> Poses:
    """Fingers that curl to 60 % of their limits."""
    angles = np.zeros((frames, len(skeleton), len(CHANNELS)))
    for joint, name in enumerate(skeleton.names):
        if name.endswith(("base", "knuckle2", "knuckle3")):
            angles[:, joint, FLEXION] = np.linspace(0.0, 0.6, frames) * skeleton.limits[joint, FLEXION, 1]
    return poses_from_angles(skeleton, angles)


def open_hands(skeleton, count: int) -> tuple[Poses, np.ndarray]:
    """Fingers spread, thumb against them."""
    angles = np.zeros((count, len(skeleton), len(CHANNELS)))
    for name, channel, degrees in (
        ("index.base", "abduction", 10),
        ("ring.base", "abduction", -8),
        ("pinky.base", "abduction", -18),
        ("thumb.base", "pivot", 30),
        ("thumb.base", "abduction", 20),
        ("thumb.base", "flexion", -10),
    ):
        angles[:, skeleton.index(name), CHANNELS.index(channel)] = np.radians(degrees)
    return poses_from_angles(skeleton, angles), angles


QUERIES = ("wp.Mesh, sign by winding number", "wp.Mesh, sign by normal")


@wp.kernel(enable_backward=False)
def query_mesh(
    mesh: wp.uint64, points: wp.array(dtype=wp.vec3), by_normal: wp.bool, distance_out: wp.array(dtype=float)
):
    """Signed distance by Warp's own queries."""
    i = wp.tid()
    point = points[i]
    if by_normal:
        found = wp.mesh_query_point_sign_normal(mesh, point, 1.0e6)
    else:
        found = wp.mesh_query_point_sign_winding_number(mesh, point, 1.0e6, 2.0, 0.5)
    near = wp.mesh_eval_position(mesh, found.face, found.u, found.v)
    distance_out[i] = found.sign * wp.length(near - point)


class MeshQuery:
    """A ``wp.Mesh`` of one object, on the CPU."""

    def __init__(self, thing: GraspObject, *, by_normal: bool) -> None:
        self._by_normal = by_normal
        vertices = wp.array(thing.vertices.astype(np.float32), dtype=wp.vec3, device="cpu")
        faces = wp.array(thing.faces.astype(np.int32).ravel(), dtype=wp.int32, device="cpu")
        self._mesh = wp.Mesh(vertices, faces, support_winding_number=not by_normal)

    def signed(self, points: np.ndarray) -> np.ndarray:
        """Signed distances [m] of points (n, 3)."""
        at = wp.array(np.ascontiguousarray(points), dtype=wp.vec3, device="cpu", copy=False)
        out = wp.zeros(len(points), dtype=float, device="cpu")
        wp.launch(query_mesh, len(points), inputs=[self._mesh.id, at, self._by_normal, out], device="cpu")
        return out.numpy()


def mesh_queries(thing: GraspObject) -> dict[str, MeshQuery]:
    """Both ways of telling inside from outside."""
    return {name: MeshQuery(thing, by_normal=name.endswith("normal")) for name in QUERIES}


class Open3DScene:
    """Open3D's ray casting scene of one object."""

    def __init__(self, thing: GraspObject, library) -> None:
        self._tensor = library.core.Tensor
        self._scene = library.t.geometry.RaycastingScene()
        vertices = self._tensor(thing.vertices.astype(np.float32))
        self._scene.add_triangles(vertices, self._tensor(thing.faces.astype(np.uint32)))

    def signed(self, points: np.ndarray, threads: int) -> np.ndarray:
        """Signed distances [m]."""
        return self._scene.compute_signed_distance(self._tensor(points), nthreads=threads).numpy()


def open3d_scene(thing: GraspObject) -> Open3DScene | None:
    """None where Open3D is not installed."""
    try:
        return Open3DScene(thing, importlib.import_module("open3d"))
    except ImportError:
        return None


def in_turn(methods: dict[str, Callable[[], object]], repeats: int) -> dict[str, list[float]]:
    """Seconds of every repeat, all methods in turn; a first round compiles."""
    times = defaultdict(list)
    for repeat in range(repeats + 1):
        for name, method in methods.items():
            start = time.perf_counter()
            method()
            if repeat:
                times[name].append(time.perf_counter() - start)
    return times


if __name__ == "__main__":
    main()
