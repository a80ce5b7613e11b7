"""Result of a diagnosis and its text; all decisions are made before."""
