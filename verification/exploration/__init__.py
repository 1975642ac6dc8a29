"""A page that moves about one problem: runs on a grid of theta and friction in both roles, step by step."""

from verification.exploration.page import Exploration, explore

__all__ = ["Exploration", "explore"]
