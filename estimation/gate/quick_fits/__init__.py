"""Quick fits of rigid body and friction to excerpts of a log."""
