"""What holds for every table of a paper: a verdict on each printed figure, a reason for each miss; the records."""

import math

import papers_table

ROUNDING = 1e-9  # figures below are rounding errors, which differ between machines


def check(report):
    for r in report.rows:
        if r.printed is not None:
            assert r.printed_verdict(), r.quantity
            assert r.place or r.where == "scan", r.quantity
        if r.printed_met is False:
            assert r.note, f"{r.quantity}: missed without a reason"
        assert (r.reported is None) == (r.where != "reported"), r.quantity
    page = report.html()
    for d in report.drawings:
        assert d.title in page


def differences(rows, recorded, relative):
    """Name every figure of computed rows that the recorded rows do not have, or have otherwise."""
    known = {(r.get("place", ""), r["quantity"]): r for r in recorded}
    found = []
    for row in rows:
        other = known.get((row.place, row.quantity))
        if other is None:
            found.append(f"{row.quantity}: not recorded")
            continue
        for name in ("printed", "literal", "ours", "target"):
            a, b = getattr(row, name), other.get(name)
            if (a is None) != (b is None):
                found.append(f"{row.quantity}: {name} {a} for {b}")
            elif a is not None and not math.isclose(a, b, rel_tol=relative, abs_tol=ROUNDING):
                found.append(f"{row.quantity}: {name} {a:.6g} for {b:.6g}")
    return found


def recorded(name):
    return papers_table.recorded(name)["rows"]
