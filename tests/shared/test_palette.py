"""Colours are told apart by all eyes, and those of numbers get lighter in even steps."""

from itertools import combinations

import numpy as np
import pytest

from meshshard.palette import COLOURS, UNLABELLED, VIRIDIS
from meshshard.view.colouring import VERDICTS

# of linear RGB, severity 1: Machado, Oliveira and Fernandes 2009
EYES = {
    "usual": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def lab(colours, eye="usual"):
    """CIE 1976 L*a*b* of hexadecimal colours as an eye sees them."""
    share = np.array([list(bytes.fromhex(colour[1:])) for colour in colours]) / 255
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    seen = np.clip(light @ np.array(EYES[eye]).T, 0, 1) @ TO_XYZ.T
    x, y, z = np.cbrt(np.maximum(seen / TO_XYZ.sum(axis=1), 0.008856)).T
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)


def nearest(colours, eye):
    """Distance of the two that are most alike; 2.3 are just told apart side by side."""
    return min(np.linalg.norm(one - other) for one, other in combinations(lab(colours, eye), 2))


@pytest.mark.parametrize("eye", EYES)
def test_classes_are_told_apart(eye):
    assert nearest((*COLOURS, UNLABELLED), eye) > 13
    assert nearest(VERDICTS.colours, eye) > 80


def test_numbers_get_lighter_in_even_steps():
    steps = np.diff(lab(VIRIDIS)[:, 0])
    assert steps.min() > 0.75 * steps.max()
