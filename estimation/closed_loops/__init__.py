"""The identified robot simulated under its controller."""
