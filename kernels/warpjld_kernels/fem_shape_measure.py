"""Shape measure of hexahedra and its gradient with respect to their nodes."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

wp.set_module_options(VECTORISED)

SIZE = 0.05
"""Weight w of an element's size."""

# the other ends of the three edges at each corner, as a right-handed triple
_ENDS = (
    (1, 2, 3, 0, 7, 4, 5, 6),
    (3, 0, 1, 2, 5, 6, 7, 4),
    (4, 5, 6, 7, 0, 1, 2, 3),
)


def _gathered() -> str:
    """C++ code for each corner's gradient: the sum of its own part and of one part of each of three neighbours, in
    ascending order."""
    lines = []
    for corner in range(8):
        parts = [(corner, 3)] + [(ends.index(corner), k) for k, ends in enumerate(_ENDS)]
        for axis in range(3):
            terms = " + ".join(f"part[{k}][{axis}][{at}]" for at, k in sorted(parts))
            lines.append(f"slope[3 * {corner} + {axis}] = {terms};")
    return "\n        ".join(lines)


@wp.func_native(
    f"""
#pragma clang fp contract(off)
    const int* corners = elements.data + 8 * size_t(element);
    double* slope = (double*)(slopes.data + 8 * size_t(element));
    const double soft = softness * softness, size_weight = {SIZE}, root27 = 3.0 * sqrt(3.0);
#if defined(__CUDA_ARCH__)
    constexpr int N = 1;
    typedef double Lanes;
#define EACH(x, l) (x)
#define ROOT(x) sqrt(x)
#else
    constexpr int N = 8;
    typedef double Lanes __attribute__((ext_vector_type(8)));
#define EACH(x, l) (x)[l]
#define ROOT(x) __builtin_elementwise_sqrt(x)
#endif
    const int ends[3][8] = {{{{{", ".join(map(str, _ENDS[0]))}}}, {{{", ".join(map(str, _ENDS[1]))}}},
                            {{{", ".join(map(str, _ENDS[2]))}}}}};
    double x[3][8], part[4][3][8], total = 0;
    for (int c = 0; c < 8; ++c)
        for (int k = 0; k < 3; ++k) x[k][c] = ((const double*)(nodes.data + corners[c]))[k];
    for (int base = 0; base < 8; base += N) {{
        Lanes a[3], b[3], d[3], ca[3], cb[3], cd[3];
        for (int k = 0; k < 3; ++k)
            for (int l = 0; l < N; ++l) {{
                const int c = base + l;
                EACH(a[k], l) = x[k][ends[0][c]] - x[k][c];
                EACH(b[k], l) = x[k][ends[1][c]] - x[k][c];
                EACH(d[k], l) = x[k][ends[2][c]] - x[k][c];
            }}
        for (int k = 0; k < 3; ++k) {{
            const int m = (k + 1) % 3, n = (k + 2) % 3;
            ca[k] = b[m] * d[n] - b[n] * d[m];
            cb[k] = d[m] * a[n] - d[n] * a[m];
            cd[k] = a[m] * b[n] - a[n] * b[m];
        }}
        const Lanes det = a[0] * ca[0] + a[1] * ca[1] + a[2] * ca[2];
        const Lanes squared = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) + (b[0] * b[0] + b[1] * b[1] + b[2] * b[2])
            + (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        const Lanes root = ROOT(det * det + soft);
        const Lanes safe = 0.5 * (det + root);
        const Lanes shape = squared * ROOT(squared) / (root27 * safe);
        const Lanes size = safe - 1.0 / safe;
        const Lanes cost = shape * shape + size_weight * size * size;
        const Lanes factor = 2.0 * shape * shape;
        const Lanes stretch = factor * 3.0 / squared;
        const Lanes rising = 0.5 * (1.0 + det / root);
        const Lanes turn = factor * rising / safe - 2.0 * size_weight * size * (1.0 + 1.0 / (safe * safe)) * rising;
        for (int k = 0; k < 3; ++k) {{
            const Lanes ga = stretch * a[k] - turn * ca[k];
            const Lanes gb = stretch * b[k] - turn * cb[k];
            const Lanes gd = stretch * d[k] - turn * cd[k];
            const Lanes own = -(ga + gb + gd);
            for (int l = 0; l < N; ++l) {{
                part[0][k][base + l] = EACH(ga, l);
                part[1][k][base + l] = EACH(gb, l);
                part[2][k][base + l] = EACH(gd, l);
                part[3][k][base + l] = EACH(own, l);
            }}
        }}
        for (int l = 0; l < N; ++l) total += EACH(cost, l);
    }}
        {_gathered()}
    costs.data[element] = total;
"""
)
def measure_element(
    element: int,
    elements: wp.array2d(dtype=wp.int32),
    softness: wp.float64,
    nodes: wp.array(dtype=wp.vec3d),
    costs: wp.array(dtype=wp.float64),
    slopes: wp.array2d(dtype=wp.vec3d),
): ...


@wp.kernel
def measure(
    # mesh
    first: int,
    elements: wp.array2d(dtype=wp.int32),
    softness: wp.float64,
    # positions, in units of the edge length wanted
    nodes: wp.array(dtype=wp.vec3d),
    # out
    cost_out: wp.array(dtype=wp.float64),
    slope_out: wp.array2d(dtype=wp.vec3d),
):
    """Σ over corners of (|A|³ / (3√3 χ))² + w (χ − 1/χ)², χ = (d + √(d² + s²)) / 2, d = det A, and its gradient.

    The second term keeps sizes similar; without it, shrinking inverted elements to a point would cost nothing.
    """
    measure_element(first + wp.tid(), elements, softness, nodes, cost_out, slope_out)


@wp.kernel
def gather(
    first: int,
    starts: wp.array(dtype=wp.int32),
    corners: wp.array(dtype=wp.int32),
    slopes: wp.array(dtype=wp.vec3d),
    # out
    slope_out: wp.array(dtype=wp.vec3d),
):
    """Gradient at each node: the sum over incident element corners, listed in ``corners`` from ``starts`` on."""
    node = first + wp.tid()
    total = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(0.0))
    for k in range(starts[node], starts[node + 1]):
        total += slopes[corners[k]]
    slope_out[node] = total
