"""How deep every vertex lies inside another part of the same surface."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def touch_depth(
    points: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
    part: wp.array(dtype=wp.int32),
    # of every part its mesh, its box, and how deep one can be inside;
    # share of a vertex that counts: 0 at a part's border, 1 inside
    meshes: wp.array(dtype=wp.uint64),
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    farthest: wp.array(dtype=float),
    inner: wp.array(dtype=float),
    # out
    depth_out: wp.array(dtype=float),
    way_out: wp.array(dtype=wp.vec3),
    other_out: wp.array(dtype=wp.int32),
):
    """The deepest of the parts a vertex is inside of: depth, the way out of it, and which part; -1 for none.

    Inside is behind the interpolated normal at the nearest point. Surfaces that face the same way do not press on
    one another, nor does what is nearest to a part's border, where the part is open.
    """
    v = wp.tid()
    p = points[v]
    deepest = float(0.0)
    way = wp.vec3(0.0, 0.0, 0.0)
    other = int(-1)
    for k in range(meshes.shape[0]):
        low = lower[k]
        high = upper[k]
        outside = p[0] < low[0] or p[1] < low[1] or p[2] < low[2] or p[0] > high[0] or p[1] > high[1] or p[2] > high[2]
        if k != part[v] and not outside:
            found = wp.mesh_query_point_no_sign(meshes[k], p, farthest[k])
            if found.result:
                mesh = wp.mesh_get(meshes[k])
                a = mesh.indices[3 * found.face]
                b = mesh.indices[3 * found.face + 1]
                c = mesh.indices[3 * found.face + 2]
                w = 1.0 - found.u - found.v
                n = wp.normalize(found.u * normals[a] + found.v * normals[b] + w * normals[c])
                border = found.u * inner[a] + found.v * inner[b] + w * inner[c]
                behind = -wp.dot(p - (found.u * points[a] + found.v * points[b] + w * points[c]), n)
                facing = wp.clamp(-2.0 * wp.dot(n, normals[v]), 0.0, 1.0)
                depth = behind * facing * border
                if depth > deepest:
                    deepest = depth
                    way = n
                    other = k
    depth_out[v] = deepest
    way_out[v] = way
    other_out[v] = other
