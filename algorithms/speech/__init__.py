"""Speech as an image: power in bands over time, features from quaternionic transforms, and recognition."""

from .descriptors import vowel_features, word_features, word_image, word_quaternions
from .features import phoneme_features
from .spectra import band_filters, band_powers, bark_image
from .wav import read_wav

__all__ = [
    "band_filters",
    "band_powers",
    "bark_image",
    "phoneme_features",
    "read_wav",
    "vowel_features",
    "word_features",
    "word_image",
    "word_quaternions",
]
