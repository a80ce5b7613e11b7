"""The design problem: objective, limits as rows, and which of them the solver sees."""
