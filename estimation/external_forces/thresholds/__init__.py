"""What a healthy robot's residual looks like: error model, threshold, calibration, and whether a model fits."""
