"""Linear programs of force closure, many small ones at once: the combination of wrenches whose least share is largest.

For wrenches w_1 … w_k: maximise t subject to Σ (t + β_j) w_j = 0, k t + Σ β_j = 1, t ≥ 0, β ≥ 0; by the two-phase
simplex method on a dense tableau of seven rows (Dantzig 1963), whose right-hand sides are perturbed against cycling.
"""

import warp as wp

ROWS = 7
"""Equations of a program."""

_PIVOTS = 400  # more than these, and the program counts as not solved; typical are 20
_SHAKE = 1e-10  # perturbation of the right-hand sides
_LEAST = 1e-10  # smallest pivot, and smallest gain of a step

wp.set_module_options({"enable_backward": False, "max_unroll": 1})


@wp.func_native(
    f"""
    const int R = {ROWS}, columns = count + 1, width = count + 2;  // shares, the least of all, right-hand side
    double* t = room.data + size_t(row) * room.shape[1];
    int* own = basis.data + size_t(row) * R;
    for (int r = 0; r < R; ++r) {{
        double sum = 0.0;
        for (int j = 0; j < count; ++j) {{
            const double x = r < 6 ? wrenches.data[6 * (size_t(first) + j) + r] : 1.0;
            t[r * width + j] = x;
            sum += x;
        }}
        t[r * width + count] = sum;
        t[r * width + columns] = (r < 6 ? 0.0 : 1.0) + {_SHAKE} * (1.0 + 0.37 * r);
        own[r] = -1;  // an artificial variable
    }}
    int artificial = R;
    for (int pivot = 0; pivot < {_PIVOTS}; ++pivot) {{
        // what enters: most infeasibility taken away, then most gained for the least share
        int enters = -1, held = -1;
        double gain = {_LEAST};
        for (int r = 0; r < R; ++r) if (own[r] == count) held = r;
        for (int j = 0; j < columns; ++j) {{
            double by = 0.0;
            if (artificial) {{
                for (int r = 0; r < R; ++r) if (own[r] < 0) by += t[r * width + j];
            }} else by = held < 0 ? (j == count ? 1.0 : 0.0) : (j == count ? 0.0 : -t[held * width + j]);
            if (by > gain) {{ gain = by; enters = j; }}
        }}
        if (enters < 0) {{
            if (!artificial) return 1;
            double left = 0.0;
            for (int r = 0; r < R; ++r) if (own[r] < 0) left += t[r * width + columns];
            return left > 1e-7 ? 0 : -1;
        }}
        int leaves = -1;
        double least = 1e300;
        for (int r = 0; r < R; ++r) {{
            const double by = t[r * width + enters];
            if (by <= {_LEAST}) continue;
            const double ratio = t[r * width + columns] / by;
            if (ratio < least) {{ least = ratio; leaves = r; }}
        }}
        if (leaves < 0) return -1;
        double* from = t + leaves * width;
        const double by = from[enters];
        for (int j = 0; j < width; ++j) from[j] /= by;
        for (int r = 0; r < R; ++r) {{
            const double times = t[r * width + enters];
            if (r == leaves || times == 0.0) continue;
            for (int j = 0; j < width; ++j) t[r * width + j] -= times * from[j];
        }}
        if (own[leaves] < 0) --artificial;
        own[leaves] = enters;
    }}
    return -1;
"""
)
def solve_program(
    wrenches: wp.array(dtype=wp.float64),
    first: int,
    count: int,
    row: int,
    room: wp.array2d(dtype=wp.float64),
    basis: wp.array2d(dtype=wp.int32),
) -> int:
    """1 where the program is solved, 0 where no combination vanishes, −1 where rounding or cycling ended the search."""


@wp.kernel
def even_shares(
    # wrenches of all programs, six numbers each, those of a program one after another
    wrenches: wp.array(dtype=wp.float64),
    first_of: wp.array(dtype=wp.int32),
    # scratch, a row a program
    room: wp.array2d(dtype=wp.float64),
    # out
    basis_out: wp.array2d(dtype=wp.int32),
    status_out: wp.array(dtype=wp.int32),
):
    """Variables of the optimal basis of every program, the least share's last of all, and its status."""
    row = wp.tid()
    first = first_of[row]
    status_out[row] = solve_program(wrenches, first, first_of[row + 1] - first, row, room, basis_out)
