"""Speech as an image: power in bands over time, and features of phonemes from quaternionic transforms."""

from .features import phoneme_features
from .spectra import band_filters, band_powers, bark_image
from .wav import read_wav

__all__ = ["band_filters", "band_powers", "bark_image", "phoneme_features", "read_wav"]
