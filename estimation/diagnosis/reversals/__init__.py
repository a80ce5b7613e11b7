"""The balance of impulses where a joint's velocity reverses."""
