"""Timing of torque against motion, by the balance of impulses at velocity reversals."""
