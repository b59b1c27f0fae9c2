"""Commands for blocks and models: blocks and inverse."""

from __future__ import annotations

from typing import Literal

import click

from hystfmu.cli.options import FILE, OUTPUT_FILE, Command, assignments, json_option
from hystfmu.report.terminal import echo, say, tell


@click.command(cls=Command)
@click.argument("name", required=False)
@click.option("--markdown", is_flag=True, hidden=True, help="Print the tables of a page.")
@json_option
def blocks(name: str | None, markdown: bool, as_json: bool) -> None:
    """List all blocks, or describe one block.

    The description contains ports, parameters, units of measure, equation and source.

    \b
    Example: hystfmu blocks zhao_tan
    """
    from hystfmu.graph import listing

    if name is None:
        if as_json or markdown:
            echo(listing.as_json() if as_json else listing.markdown())
        else:
            tell(listing.overview())
    elif as_json:
        echo(listing.as_json(name))
    else:
        tell(listing.details(name))


@click.command(cls=Command)
@click.argument("model", type=FILE)
@click.option("-o", "out", required=True, type=OUTPUT_FILE, metavar="INV.model.toml", help="Model file to write.")
@click.option(
    "--method",
    type=click.Choice(["auto", "exact", "implicit", "learned", "adaptive"]),
    default="auto",
    show_default=True,
    help="exact: closed form; implicit: one root of the model per step; learned: a network, as in the papers; "
    "adaptive: a closed form that learns its weights during operation; auto: the first of the others that is possible.",
)
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Option of the method; repeatable.")
@click.option("--seed", default=0, show_default=True, help="Seed of the learned inverse.")
def inverse(
    model: str,
    out: str,
    method: Literal["auto", "exact", "implicit", "learned", "adaptive"],
    settings: tuple[str, ...],
    seed: int,
) -> None:
    """Compute the inverse of a model.

    The input of the inverse is the wanted output of the model; its output is the model input that produces it.

    The learned inverse is trained with the response of the model to random nested reversals; input and output are
    exchanged. A network of 12 neurons reads the inverse operator of Zhao & Tan and a few plays of the wanted output.
    The network corrects the wanted output, and the exact inverse of fitted plays follows. Options of the learned
    inverse are hidden, N (plays), starts, iterations, ... Options of the implicit inverse are lo and hi.

    A feed-forward from a few samples of the wanted output inverts linear dynamics and a delay behind the hysteresis.
    The output of the model then lags the wanted output by whole steps; the command prints this lag.

    The adaptive inverse exists for Prandtl-Ishlinskii models. Its input v is the wanted output before dynamics and
    delay (feed-forward plus feedback). Its other inputs are the reference y_d and the measured output y. Options are
    f_n, zeta and delay of the dynamics after a static model, and the time constant T (s) of a drift. 'hystfmu blocks
    adaptive_inverse' lists further options.

    \b
    Example: hystfmu inverse piezo.model.toml -o inverse.model.toml
             hystfmu inverse piezo.model.toml --method learned -o learned.toml
             hystfmu inverse piezo.model.toml --method adaptive -o adaptive.toml
    """
    import hystfmu as hy
    from hystfmu.report.terminal import progress

    with progress("inverting") as report:
        made = hy.Model.load(model).inverse(method, seed, report, **assignments(settings))
    made.save(out)
    rms, most = (made.fit.get(f"cascade_{k}_percent") for k in ("rms", "max"))
    worth = "" if rms is None else f": error of inverse and model in cascade: RMS {rms:.2g} %, max {most:.2g} % of span"
    say(f"wrote {out}, {made.provenance['inverse']} inverse{worth}")
    if len(made.graph.outputs) > 1:
        inputs, outputs = (", ".join(p.name for p in ports) for ports in (made.graph.inputs, made.graph.outputs))
        say(f"inputs {inputs}; outputs {outputs}")
    if late := made.fit.get("lag_steps"):
        say(
            f"the output of the model lags the wanted output by {late} steps ({made.fit['lag']:.3g} s), accurately up "
            f"to {made.fit['band']:.3g} Hz: give the reference earlier by this lag"
        )
    for warning in made.fit.get("warnings", ()):
        echo(f"warning: {warning}", err=True)
