"""Torques predicted for unseen logs, and estimators compared on them."""
