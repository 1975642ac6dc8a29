"""The norm is part of the proof: the circle criterion for two layers, and for two bodies on their meshes."""
