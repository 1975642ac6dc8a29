"""The theorem in energy norms for two rectangles, without a mesh."""
