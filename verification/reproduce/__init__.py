"""Section 6 of the paper run again: readings of what its text leaves open, and a verdict for each figure."""

from verification.reproduce.experiments import FIGURES, Reproduction, reproduce
from verification.reproduce.readings import READINGS, ModelReading

__all__ = ["FIGURES", "READINGS", "ModelReading", "Reproduction", "reproduce"]
