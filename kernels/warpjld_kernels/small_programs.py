"""Linear programs of seven equations, many at once, for force closure and resisted wrenches.

For columns a_1 … a_n: maximise x_n subject to Σ x_j a_j = (0, 0, 0, 0, 0, 0, 1), x ≥ 0; by the two-phase simplex method
on a dense tableau (Dantzig 1963). Against cycling the right-hand sides are perturbed, by a combination of all columns
with small positive coefficients: a program that has a solution keeps it, also where Σ x_j a_j cannot reach all
directions.
"""

import warp as wp

ROWS = 7
"""Equations of a program."""

_PIVOTS = 400  # more than these, and the program counts as not solved; typical are 20
_SHAKE = 1e-10  # perturbation of the variables, all of which are at least minus 0.5 to 1.5 times this
_LEAST = 1e-10  # smallest pivot, and smallest gain of a step

wp.set_module_options({"enable_backward": False, "max_unroll": 1})


@wp.func_native(
    f"""
    const int R = {ROWS}, last = count - 1, width = count + 1;  // columns, right-hand side
    double* t = room.data + size_t(row) * room.shape[1];
    int* own = basis.data + size_t(row) * R;
    for (int r = 0; r < R; ++r) {{
        for (int j = 0; j < count; ++j) t[r * width + j] = columns.data[R * (size_t(first) + j) + r];
        double sum = 0.0, share = 0.0;  // of all columns, each with another share
        for (int j = 0; j < count; ++j) {{
            share += 0.6180339887498949;
            if (share >= 1.0) share -= 1.0;
            sum += (0.5 + share) * t[r * width + j];
        }}
        t[r * width + count] = (r < 6 ? 0.0 : 1.0) + {_SHAKE} * sum;
        if (t[r * width + count] < 0.0) for (int j = 0; j < width; ++j) t[r * width + j] = -t[r * width + j];
        own[r] = -1;  // an artificial variable
    }}
    int artificial = R;
    for (int pivot = 0; pivot < {_PIVOTS}; ++pivot) {{
        // what enters: most infeasibility taken away, then most gained
        int enters = -1, held = -1;
        double gain = {_LEAST};
        for (int r = 0; r < R; ++r) if (own[r] == last) held = r;
        for (int j = 0; j < count; ++j) {{
            double by = 0.0;
            if (artificial) {{
                for (int r = 0; r < R; ++r) if (own[r] < 0) by += t[r * width + j];
            }} else by = held < 0 ? (j == last ? 1.0 : 0.0) : (j == last ? 0.0 : -t[held * width + j]);
            if (by > gain) {{ gain = by; enters = j; }}
        }}
        if (enters < 0) {{
            if (!artificial) return 1;
            double left = 0.0;
            for (int r = 0; r < R; ++r) if (own[r] < 0) left += t[r * width + count];
            return left > 1e-7 ? 0 : -1;
        }}
        int leaves = -1;
        double least = 1e300;
        for (int r = 0; r < R; ++r) {{
            const double by = t[r * width + enters];
            if (by <= {_LEAST}) continue;
            const double ratio = t[r * width + count] / by;
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
    columns: wp.array(dtype=wp.float64),
    first: int,
    count: int,
    row: int,
    room: wp.array2d(dtype=wp.float64),
    basis: wp.array2d(dtype=wp.int32),
) -> int:
    """1 where the program is solved, 0 where it has no solution, −1 where rounding or cycling ended the search."""


@wp.kernel
def solve_programs(
    # columns of all programs, seven numbers each, those of a program one after another
    columns: wp.array(dtype=wp.float64),
    first_of: wp.array(dtype=wp.int32),
    # scratch, a row a program
    room: wp.array2d(dtype=wp.float64),
    # out
    basis_out: wp.array2d(dtype=wp.int32),
    status_out: wp.array(dtype=wp.int32),
):
    """Columns of the optimal basis of every program, and its status as of ``solve_program``."""
    row = wp.tid()
    first = first_of[row]
    status_out[row] = solve_program(columns, first, first_of[row + 1] - first, row, room, basis_out)
