"""The norm is part of the proof: the circle criterion for two layers."""
