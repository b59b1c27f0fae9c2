"""The order in which the blocks of a graph are evaluated, and the sentence about an algebraic loop."""

from __future__ import annotations

from collections.abc import Sequence

from hystfmu.base.errors import InputError


def evaluation_order(names: Sequence[str], through: Sequence[bool], edges: set[tuple[int, int]]) -> list[int]:
    """Sources before what reads them; in a loop, the blocks that only read held values first.

    Parameters
    ----------
    names : sequence of str
        Of the blocks, in the order that is kept where it fits already.
    through : sequence of bool
        Which of them have direct feed-through.
    edges : set of (int, int)
        (source, reader), as places in `names`.

    Returns
    -------
    list of int
        Places in the order of evaluation.

    Raises
    ------
    InputError
        An algebraic loop, with the names along it.
    """
    order, left = _sorted(len(names), edges)
    if not left:
        return order
    edges = {(s, d) for s, d in edges if through[d]}
    order, left = _sorted(len(names), edges)
    if not left:
        # in a loop, a block that only reads held values must not read a new one: it goes first
        return sorted(order, key=lambda i: through[i])
    path = [left[0]]
    while path.count(path[-1]) < 2:
        path.append(next(s for s, d in sorted(edges) if d == path[-1] and s in left))
    loop = " <- ".join(names[i] for i in path[path.index(path[-1]) :])
    raise InputError(f"algebraic loop: {loop}; put a delay or a strictly proper transfer_function into it")


def _sorted(n: int, edges: set[tuple[int, int]]) -> tuple[list[int], list[int]]:
    """Places in order, and those that wait for each other."""
    order: list[int] = []
    left = list(range(n))
    while left:
        free = [i for i in left if not any(s in left for s, d in edges if d == i)]
        if not free:
            break
        # one at a time and the first in the listed order, so that an order that already fits stays as it is
        order.append(free[0])
        left.remove(free[0])
    return order, left
