"""From measured curves to laws: readers, tensile, bias-extension and picture-frame tests, marker tracking."""

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
