"""Warnings as texts: one of each kind, and none of other categories lost."""

from __future__ import annotations

import warnings

import pytest

from warpjld.runtime.warning_texts import warning_texts


class Told(UserWarning):
    """What is collected."""


def test_one_text_of_each_kind_and_only_new_ones() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nothing is issued
        with warning_texts(Told) as texts:
            warnings.warn("1.5 mm deep", Told, stacklevel=1)
            warnings.warn("2.25 mm deep", Told, stacklevel=1)
            assert texts() == ["1.5 mm deep"]
            warnings.warn("3 mm deep", Told, stacklevel=1)
            warnings.warn("too coarse", Told, stacklevel=1)
            assert texts() == ["too coarse"]


def test_others_are_issued() -> None:
    with pytest.warns(DeprecationWarning, match="old"):
        _old_and_told()


def _old_and_told() -> None:
    with warning_texts(Told) as texts:
        warnings.warn("old", DeprecationWarning, stacklevel=1)
        assert texts() == []
