"""From measured curves to laws: readers, tensile, bias-extension and picture-frame tests, marker tracking."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from weftform.laboratory.bias_extension import BiasExtensionCharacterisation, characterise_bias_extension
    from weftform.laboratory.full_field import ShearField, read_shear_field, shear_field
    from weftform.laboratory.markers import MarkerTracking, track_markers
    from weftform.laboratory.picture_frame import PictureFrameCharacterisation, characterise_picture_frame
    from weftform.laboratory.presets import Quantity
    from weftform.laboratory.samples import copy_samples, sample, sample_names
    from weftform.laboratory.slip import SlipOnset, slip_onset
    from weftform.laboratory.specimen import Reading
    from weftform.laboratory.stages import LockingCriterion
    from weftform.laboratory.table import MeasuredTable, read_table
    from weftform.laboratory.tensile import TensileCharacterisation, characterise_tensile

__all__ = [
    "BiasExtensionCharacterisation",
    "LockingCriterion",
    "MarkerTracking",
    "MeasuredTable",
    "PictureFrameCharacterisation",
    "Quantity",
    "Reading",
    "ShearField",
    "SlipOnset",
    "TensileCharacterisation",
    "characterise_bias_extension",
    "characterise_picture_frame",
    "characterise_tensile",
    "copy_samples",
    "read_shear_field",
    "read_table",
    "sample",
    "sample_names",
    "shear_field",
    "slip_onset",
    "track_markers",
]

_HOMES = {
    "BiasExtensionCharacterisation": "weftform.laboratory.bias_extension",
    "LockingCriterion": "weftform.laboratory.stages",
    "MarkerTracking": "weftform.laboratory.markers",
    "MeasuredTable": "weftform.laboratory.table",
    "PictureFrameCharacterisation": "weftform.laboratory.picture_frame",
    "Quantity": "weftform.laboratory.presets",
    "Reading": "weftform.laboratory.specimen",
    "ShearField": "weftform.laboratory.full_field",
    "SlipOnset": "weftform.laboratory.slip",
    "TensileCharacterisation": "weftform.laboratory.tensile",
    "characterise_bias_extension": "weftform.laboratory.bias_extension",
    "characterise_picture_frame": "weftform.laboratory.picture_frame",
    "characterise_tensile": "weftform.laboratory.tensile",
    "copy_samples": "weftform.laboratory.samples",
    "read_shear_field": "weftform.laboratory.full_field",
    "read_table": "weftform.laboratory.table",
    "sample": "weftform.laboratory.samples",
    "sample_names": "weftform.laboratory.samples",
    "shear_field": "weftform.laboratory.full_field",
    "slip_onset": "weftform.laboratory.slip",
    "track_markers": "weftform.laboratory.markers",
}


def __getattr__(name: str) -> Any:
    """Import the public names when they are first used: fitting brings in scipy.optimize."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
