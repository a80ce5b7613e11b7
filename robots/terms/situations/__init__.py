"""Situations, the input of effects: the motion, the base model's torque, and its sensitivities."""
