"""What an effect may depend on: the motion, the base model's torque, and its sensitivities."""
