"""Sparsity pattern of a mesh of 8-node elements: which nodes share an element, in ascending order."""

import warp as wp

wp.set_module_options({"enable_backward": False})

MOST_NEIGHBOURS = 512
"""Neighbours a node may have; a regular inner node has 27. More are reported, never dropped silently."""


@wp.func_native(
    f"""
    int found[{MOST_NEIGHBOURS}];
    int count = 0;
    bool full = false;
    for (int k = starts.data[node]; k < starts.data[node + 1]; ++k) {{
        const int* corner = elements.data + 8 * incident.data[k];
        for (int b = 0; b < 8; ++b) {{
            const int other = corner[b];
            int place = count;
            while (place > 0 && found[place - 1] > other) --place;
            if (place > 0 && found[place - 1] == other) continue;
            if (count == {MOST_NEIGHBOURS}) {{
                full = true;
                continue;
            }}
            for (int m = count; m > place; --m) found[m] = found[m - 1];
            found[place] = other;
            ++count;
        }}
    }}
    if (fill) {{
        int* out = columns.data + rows.data[node];
        for (int m = 0; m < count; ++m) out[m] = found[m];
    }} else {{
        rows.data[node + 1] = full ? -1 : count;
    }}
"""
)
def neighbours_of(
    node: int,
    starts: wp.array(dtype=wp.int32),
    incident: wp.array(dtype=wp.int32),
    elements: wp.array2d(dtype=wp.int32),
    fill: wp.bool,
    rows: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
): ...


@wp.kernel
def node_neighbours(
    # mesh
    first: int,
    starts: wp.array(dtype=wp.int32),
    incident: wp.array(dtype=wp.int32),
    elements: wp.array2d(dtype=wp.int32),
    fill: wp.bool,
    # out
    rows_out: wp.array(dtype=wp.int32),
    columns_out: wp.array(dtype=wp.int32),
):
    """Without ``fill``: how many neighbours each node has; with it: which."""
    node = first + wp.tid()
    neighbours_of(node, starts, incident, elements, fill, rows_out, columns_out)


@wp.kernel
def element_slots(
    # mesh
    first: int,
    elements: wp.array2d(dtype=wp.int32),
    rows: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
    # out
    slots_out: wp.array2d(dtype=wp.int32),
):
    """Block of the matrix that corner pair (a, b) of an element adds to."""
    element = first + wp.tid()
    for a in range(8):
        row = elements[element, a]
        for b in range(8):
            want = elements[element, b]
            low = rows[row]
            high = rows[row + 1] - 1
            while low < high:
                middle = (low + high) // 2
                if columns[middle] < want:
                    low = middle + 1
                else:
                    high = middle
            slots_out[element, 8 * a + b] = low
