"""``weftform cards``: list the shipped fabric cards, or show one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from weftform.cli.options import AsJson


def cards(
    name: Annotated[
        str | None, typer.Argument(metavar="[CARD]", help="Show this card: a shipped name or a TOML file.")
    ] = None,
    as_json: AsJson = False,
    copy_to: Annotated[
        Path | None,
        typer.Option("--copy-to", metavar="FILE", help="Write the card's TOML there, to start your own from."),
    ] = None,
) -> None:
    """List the shipped fabric cards, or show one.

    Examples: weftform cards; weftform cards hexforce-48600-c1300; weftform cards hexforce-48600-c1300 --copy-to
    mine.toml
    """
    from weftform.errors import CardError
    from weftform.fabric import Fabric, shipped_cards

    if name is None:
        found = {card: Fabric.load(card) for card in shipped_cards()}
        if as_json:
            typer.echo(json.dumps({card: fabric.card.description for card, fabric in found.items()}, indent=2))
            return
        width = max(len(card) for card in found)
        for card, fabric in found.items():
            typer.echo(f"{card:<{width}}  {fabric.card.description}")
        return
    fabric = Fabric.load(name)
    if copy_to is not None:
        if copy_to.exists():
            raise CardError("the file exists and is left as it is", file=copy_to, hint="choose another name")
        source = shipped_cards().get(name, Path(name))
        try:
            copy_to.write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
        except OSError as problem:
            raise CardError(f"cannot be written ({problem.strerror})", file=copy_to) from None
        typer.echo(f"wrote {copy_to}")
        return
    if as_json:
        typer.echo(fabric.card.model_dump_json(indent=2, exclude_none=True))
        return
    typer.echo("\n".join(describe(fabric)))


def describe(fabric) -> list[str]:  # type: ignore[no-untyped-def]
    """A card in words and a short table of its laws."""
    import numpy as np

    card = fabric.card
    sheet = card.fabric
    lines = [
        f"{card.name}: {card.description}",
        f"  areal weight {sheet.areal_weight_g_m2:g} g/m2, thickness {sheet.thickness_mm:g} mm"
        + (f", {sheet.weave}" if sheet.weave else "")
        + (", balanced" if fabric.balanced else ", warp and weft differ"),
        "",
    ]
    for direction, law in (("warp", fabric.warp), ("weft", fabric.weft)):
        end = min(law.specimen_force.valid_to, 0.1 * law.length)
        u = np.linspace(0.0, end, 6)[1:]
        lines.append(f"  tension, {direction}: specimen {law.length:g} x {law.width:g} mm, valid to {end:g} mm")
        lines.append("    elongation [mm]  " + "".join(f"{x:10.3g}" for x in u))
        lines.append("    force [N]        " + "".join(f"{x:10.4g}" for x in law.force(u)))
    angles = np.array([10.0, 20.0, 30.0, 40.0, 50.0, 60.0])
    lines += [
        f"  shear: valid to {np.degrees(fabric.shear.valid_to):g} degrees",
        "    shear angle [deg]" + "".join(f"{a:10.3g}" for a in angles),
        "    F_sh [N/mm]      " + "".join(f"{v:10.4g}" for v in fabric.normalised_shear_force(np.radians(angles))),
        "    G12 [MPa]        " + "".join(f"{v:10.4g}" for v in fabric.shear.modulus(np.radians(angles))),
        f"  membrane along the yarns: {card.membrane.warp_modulus_MPa:g} and {card.membrane.weft_modulus_MPa:g} MPa",
    ]
    if card.tension.variants:
        lines.append("  tension variants: " + ", ".join(card.tension.variants))
    sources = [("tension", card.tension.warp.source), ("shear", card.shear.source)]
    lines += ["", *(f"  {what} from: {source}" for what, source in sources if source)]
    return lines
