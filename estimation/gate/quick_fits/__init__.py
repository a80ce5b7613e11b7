"""The quick fit that shows whether torque follows from motion at all."""
