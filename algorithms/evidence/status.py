"""The meaning of a status, which all estimators share."""

from __future__ import annotations

from enum import IntEnum

WRONG = 1e-3
"""Probability with which a result may be OK and wrong. All tests use it, unless they are made many times."""
RARE = 1e-6
"""Probability below which noise does not explain one of many items, which is then wrong."""


class Status(IntEnum):
    """Whether a result can be used, and if not, why.

    OK means that the error exceeds the stated bound with a probability of at most `WRONG` under the stated model of the
    noise, and that the data do not contradict this model. Every other member names what is missing: data that are too
    few or leave something undetermined, several results that the data cannot separate, or data that contradict each
    other. Each subclass lists its members; OK is 0 in all of them.
    """
