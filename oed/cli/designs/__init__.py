"""What `oed design` does beside its usual design: payloads, two possible causes, poses for a calibration."""
