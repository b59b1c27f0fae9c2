"""What holds for every table of a paper: each printed figure has a verdict, and each miss a reason."""

import paper_items


def check(report):
    for r in report.rows:
        if r.printed is not None:
            assert r.printed_verdict(), r.quantity
            assert r.place or r.where == "scan", r.quantity
        if r.printed_met is False:
            assert r.note, f"{r.quantity}: missed without a reason"
        assert (r.reported is None) == (r.where != "reported"), r.quantity
    if report.drawings:
        paper_items.check(report)
    page = report.html()
    for d in report.drawings:
        assert d.plot.title.startswith(d.place), d.plot.title
        assert d.plot.title in page
