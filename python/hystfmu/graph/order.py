"""Evaluation order of the blocks of a graph; detection of algebraic loops."""

from __future__ import annotations

from collections.abc import Sequence

from hystfmu.base.errors import InputError


def evaluation_order(names: Sequence[str], through: Sequence[bool], edges: set[tuple[int, int]]) -> list[int]:
    """Order blocks so that each source precedes its readers; in a loop, blocks that read held values come first.

    Parameters
    ----------
    names : sequence of str
        Block names; an order that is already valid is kept.
    through : sequence of bool
        Which blocks have direct feed-through.
    edges : set of (int, int)
        Wires (source, reader), as indices into `names`.

    Returns
    -------
    list of int
        Indices in evaluation order.

    Raises
    ------
    InputError
        An algebraic loop; the message names its blocks.
    """
    order, left = _sorted(len(names), edges)
    if not left:
        return order
    edges = {(s, d) for s, d in edges if through[d]}
    order, left = _sorted(len(names), edges)
    if not left:
        # in a loop, a block without direct feed-through reads held values, so it goes before its sources are updated
        return sorted(order, key=lambda i: through[i])
    path = [left[0]]
    while path.count(path[-1]) < 2:
        path.append(next(s for s, d in sorted(edges) if d == path[-1] and s in left))
    loop = " <- ".join(names[i] for i in path[path.index(path[-1]) :])
    raise InputError(
        f"The wires must not form an algebraic loop: {loop}. Insert a delay or a strictly proper transfer_function."
    )


def _sorted(n: int, edges: set[tuple[int, int]]) -> tuple[list[int], list[int]]:
    """Sort topologically; return the sorted indices and those left over in cycles."""
    order: list[int] = []
    left = list(range(n))
    while left:
        free = [i for i in left if not any(s in left for s, d in edges if d == i)]
        if not free:
            break
        # take only the first free block each time, so that a valid order is kept
        order.append(free[0])
        left.remove(free[0])
    return order, left
