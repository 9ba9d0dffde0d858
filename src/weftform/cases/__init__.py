"""The kinds of study: what each one builds, records and sums up. One file per kind."""

from __future__ import annotations

from weftform.cases.case import Case
from weftform.study.study import Study


def case_of(study: Study) -> Case:
    """The case of a study, by its kind."""
    from weftform.cases import bias, element, forming, frame, strip

    kinds: dict[str, type[Case]] = {
        "forming": forming.Forming,
        "tensile": strip.Tensile,
        "biaxial": strip.Biaxial,
        "bias-extension": bias.BiasExtension,
        "picture-frame": frame.PictureFrame,
        "element": element.Element,
    }
    return kinds[study.model.kind](study)


__all__ = ["Case", "case_of"]
